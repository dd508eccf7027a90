"""`scripts/checks`: what the check scripts compute, on small cases."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from checks import devices, free_root


@pytest.mark.parametrize("border", [False, True])
def test_the_step_of_a_free_root_is_that_of_qr(border: bool) -> None:
    found = free_root.measure(300, border=border)
    assert found.refined < 1e-6 and found.refined <= found.cholesky


def test_the_processor_is_always_found() -> None:
    assert devices.found()[-1] == "cpu"


def test_estimates_that_differ_are_told() -> None:
    one = devices.Timing("cpu", 1.0, 2.0, 3.0)
    assert devices.spread([one, devices.Timing("gpu", 1.0, 2.0, 3.5)]) == pytest.approx(0.5)
    assert devices.spread([one]) == 0.0

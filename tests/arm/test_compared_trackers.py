"""`scripts/reproduce_arm_ukf`: only what is wanted is run."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))

from arm_ukf import trackers
from arm_ukf.trackers import JOINTS, OPTIMISER, PAPER, ROBUST, SMOOTHED


class _Found:
    solution = None


@pytest.mark.parametrize(
    ("wanted", "runs"),
    [
        ((PAPER,), []), ((JOINTS,), ["filter"]), ((SMOOTHED,), ["smoother"]),
        ((PAPER, OPTIMISER), ["smoother", "optimiser"]),
        ((SMOOTHED, OPTIMISER, ROBUST), ["smoother", "optimiser", "robust"]),
    ],
)  # fmt: skip
def test_only_what_is_wanted_is_run(
    monkeypatch: pytest.MonkeyPatch, wanted: tuple[str, ...], runs: list[str]
) -> None:
    done: list[str] = []

    def joint_filter(_: object, smooth: bool = False) -> _Found:
        done.append("smoother" if smooth else "filter")
        return _Found()

    def optimised(_: object, *, robust: bool, initial: _Found) -> _Found:
        done.append("robust" if robust else "optimiser")
        return _Found()

    monkeypatch.setattr(trackers, "declared", lambda *_: None)
    monkeypatch.setattr(trackers, "paper_tracker", lambda _: _Found())
    monkeypatch.setattr(trackers, "joint_filter", joint_filter)
    monkeypatch.setattr(trackers, "optimised", optimised)
    assert tuple(trackers.track(None, None, wanted)) == wanted  # type: ignore[arg-type]
    assert done == runs

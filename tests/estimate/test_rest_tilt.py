"""Accelerations of the rest hold beside the kinds chosen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mocap_jax as mj
from mocap_jax.estimate.inputs import body_of
from mocap_jax.estimate.rest_tilt import gather_with_rest

RECORDING = mj.read_recording(Path(__file__).resolve().parents[2] / "data" / "demo.mcap")


@pytest.mark.parametrize("kinds", ["G", "GD", "D"])
def test_accelerations_count_in_the_rest_hold_alone(kinds: str) -> None:
    data = gather_with_rest(
        RECORDING, body_of(RECORDING, None), mj.OptimiseOptions(kinds=kinds), root=True
    )
    rest, time = RECORDING.setup.rest, np.asarray(data.time)
    held = (time >= rest.start) & (time <= rest.end)
    known = np.isfinite(np.asarray(data.accelerometer))
    assert known[held].mean() > 0.9
    assert not known[~held].any()


def test_accelerometers_that_are_chosen_count_all_along() -> None:
    data = gather_with_rest(
        RECORDING, body_of(RECORDING, None), mj.OptimiseOptions(kinds="AG"), root=True
    )
    assert np.isfinite(np.asarray(data.accelerometer)).mean() > 0.9


def test_chosen_kinds_that_are_absent_are_still_an_error() -> None:
    with pytest.raises(mj.MocapError, match="no measurement of the kinds 'O'"):
        mj.optimise(RECORDING, options=mj.OptimiseOptions(kinds="O"))

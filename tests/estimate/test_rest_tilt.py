"""Accelerations of the rest hold beside the kinds chosen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mocap_jax as mj
from mocap_jax.estimate.inputs import body_of
from mocap_jax.estimate.rest_tilt import gather_with_rest

RECORDING = mj.read_recording(Path(__file__).resolve().parents[2] / "data" / "demo.mcap")


@pytest.mark.parametrize("kinds", ["G", "GD"])
def test_accelerations_count_in_the_rest_hold_alone(kinds: str) -> None:
    data = gather_with_rest(
        RECORDING, body_of(RECORDING, None), mj.OptimiseOptions(kinds=kinds), root=True
    )
    rest, time = RECORDING.setup.rest, np.asarray(data.time)
    held = (time >= rest.start) & (time <= rest.end)
    known = np.isfinite(np.asarray(data.accelerometer))
    assert known[held].mean() > 0.9
    assert not known[~held].any()


@pytest.mark.parametrize(("kinds", "all_along"), [("AG", True), ("D", False)])
def test_kinds_with_accelerometers_or_without_boards_are_as_chosen(kinds, all_along) -> None:
    data = gather_with_rest(
        RECORDING, body_of(RECORDING, None), mj.OptimiseOptions(kinds=kinds), root=True
    )
    known = np.isfinite(np.asarray(data.accelerometer))
    assert (known.mean() > 0.9) if all_along else not known.any()


def test_chosen_kinds_that_are_absent_are_still_an_error() -> None:
    with pytest.raises(mj.MocapError, match="no measurement of the kinds 'O'"):
        mj.optimise(RECORDING, options=mj.OptimiseOptions(kinds="O"))

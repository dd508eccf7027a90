"""Ranges on their way into frames: none is lost, whatever the stamps of several frequencies."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.body import load_body
from mocap_jax.measurement import FrameData, gather
from mocap_jax.recording import InertialStream, RangeStream, Recording, SensorSpec, Setup

XML = """<mujoco><worldbody><body name="pelvis" pos="0 0 1"><freejoint name="root"/>
<geom size=".1"/><site name="pelvis"/><site name="source/a" pos=".1 0 0"/>
<site name="source/b" pos="0 .1 0"/><body name="thigh"><joint name="hip" type="ball"/>
<geom size=".1"/><site name="thigh"/></body></body></worldbody></mujoco>"""
SENSORS, SOURCES = ("pelvis", "thigh"), ("source/a", "source/b")
PULSE, SECONDS = 0.008, 1.0


def recording(sources: int, late: float = 0.0) -> Recording:
    """Sources that sound side by side, the second one late [s]; each range tells its number."""
    time = np.arange(0.0, SECONDS, 1 / 140)
    board = InertialStream(
        time, np.zeros((len(time), 3)), np.zeros((len(time), 3)), np.full((len(time), 4), np.nan)
    )
    pulse = np.arange(0.0011, SECONDS - 0.02, PULSE)
    stamp, source, receiver = (
        x.ravel()
        for x in np.meshgrid(pulse, np.arange(sources), np.arange(len(SENSORS)), indexing="ij")
    )
    n = len(stamp)
    ranges = RangeStream(
        stamp + late * source, source, receiver, 1 + np.arange(n) / n, np.ones(n),
        SOURCES[:sources], SENSORS,
    )  # fmt: skip
    setup = Setup(
        sensors=tuple(SensorSpec(s, s, 140.0) for s in SENSORS), sources=SOURCES[:sources],
        pulse_interval=PULSE,
    )  # fmt: skip
    return Recording(dict.fromkeys(SENSORS, board), ranges, None, {}, None, None, setup, XML)


def frames(made: Recording) -> FrameData:
    return gather(made, load_body(XML), kinds="D")


@pytest.mark.parametrize("late", [0.0, 1e-5, 3e-3])
def test_ranges_of_two_frequencies_all_arrive(late: float) -> None:
    made = recording(2, late)
    data = frames(made)
    used = data.range_weight > 0
    np.testing.assert_array_equal(np.sort(data.range_distance[used]), made.ranges.distance)
    assert data.range_weight.shape[1] == 2 * len(SENSORS)


def test_one_frequency_takes_the_room_of_its_pulses() -> None:
    made = recording(1)
    data = frames(made)
    assert data.range_weight.shape[1] == len(SENSORS)
    assert (data.range_weight > 0).sum() == len(made.ranges.time)

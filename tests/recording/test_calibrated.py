"""Readings corrected by a calibration, once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mocap_jax.recording import (
    AxisCalibration,
    Calibration,
    InertialStream,
    RangeStream,
    Recording,
    Setup,
    SourceOffset,
    Truth,
    calibrated,
    uncalibrated,
    with_calibration,
)
from mocap_jax.trajectory import Trajectory

ACCELEROMETER = AxisCalibration(zero=(0.1, -0.2, 0.3), slope=(1.02, 0.97, 1.0))
GYROSCOPE = AxisCalibration(zero=(0.01, 0.0, -0.02), slope=(0.99, 1.0, 1.05))


@pytest.fixture
def true() -> Recording:
    """What perfect sensors would read."""
    random = np.random.default_rng(0)
    time = np.arange(20) / 100

    def board() -> InertialStream:
        force, rate = random.normal(size=(2, 20, 3))
        force[3] = np.nan
        return InertialStream(time, 9 * force, rate, np.full((20, 4), np.nan))

    ranges = RangeStream(
        time, np.arange(20) % 2, np.zeros(20, int), random.uniform(0.5, 1, 20), np.ones(20),
        ("source/a", "source/b"), ("one",),
    )  # fmt: skip
    return Recording(
        inertial={"one": board(), "two": board()}, ranges=ranges, root=None, magnetic={},
        temperature=None, truth=None, setup=Setup(), body_xml=None,
    )  # fmt: skip


CALIBRATION = Calibration(
    accelerometer={"one": ACCELEROMETER}, gyroscope={"one": GYROSCOPE},
    source_offset={"source/b": SourceOffset(0.02)},
)  # fmt: skip


@pytest.fixture
def read(true) -> Recording:
    """The same as sensors of known errors read it; errors written out here."""
    one = true.inertial["one"]
    wrong = replace(
        one,
        accelerometer=one.accelerometer * [1.02, 0.97, 1.0] + [0.1, -0.2, 0.3],
        gyroscope=one.gyroscope * [0.99, 1.0, 1.05] + [0.01, 0.0, -0.02],
    )
    distance = true.ranges.distance + np.where(np.arange(20) % 2, 0.02, 0.0)
    return replace(
        true, inertial=true.inertial | {"one": wrong},
        ranges=replace(true.ranges, distance=distance), setup=Setup(calibration=CALIBRATION),
    )  # fmt: skip


def same(a: Recording, b: Recording) -> None:
    for name in a.inertial:
        for kind in ("accelerometer", "gyroscope"):
            one, other = getattr(a.inertial[name], kind), getattr(b.inertial[name], kind)
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-13)
    np.testing.assert_allclose(a.ranges.distance, b.ranges.distance, rtol=0, atol=1e-15)


def test_readings_are_corrected_once(true, read) -> None:
    out = calibrated(read)
    same(out, true)
    assert out.setup.calibration.applied
    assert calibrated(out) is out
    back = uncalibrated(out)
    same(back, read)
    assert back.setup == read.setup
    assert uncalibrated(read) is read


def test_true_errors_are_told_for_the_readings_as_they_are_corrected(true, read) -> None:
    """What the simulator tells under one calibration, checked sample by sample under another."""
    errs = {"accelerometer": ([1.02, 0.97, 1.0], [0.1, -0.2, 0.3]),
            "gyroscope": ([0.99, 1.0, 1.05], [0.01, 0.0, -0.02])}  # fmt: skip
    older = AxisCalibration(zero=(0.3, 0.1, -0.1), slope=(1.1, 0.9, 1.2))
    told = {"source_offset/b": np.array(0.02 - 0.005), "accelerometer_bias/two": np.full(3, 7.0)}
    for kind, (scale, bias) in errs.items():
        told[f"{kind}_scale/one"] = np.array(scale) / older.slope
        told[f"{kind}_bias/one"] = (np.array(bias) - older.zero) / older.slope
        told[f"{kind}_drift/one"] = np.zeros((20, 3)) + 0.1 / np.array(older.slope)
    declared = Calibration(
        accelerometer={"one": older}, gyroscope={"one": older},
        source_offset={"source/b": SourceOffset(0.005)},
    )  # fmt: skip
    truth = Truth(Trajectory(np.arange(2.0), np.zeros((2, 1))), "<mujoco/>", told)
    start = replace(read, setup=Setup(calibration=declared), truth=truth)
    # Applied or not, the truth is told for corrected readings: going to and fro changes nothing.
    assert calibrated(start).truth is truth and uncalibrated(calibrated(start)).truth is truth
    newer = Calibration(
        accelerometer={"one": AxisCalibration(zero=(0.2, 0.2, 0.2), slope=(0.9, 0.9, 0.9))},
        source_offset={"b": SourceOffset(0.012)},
    )
    for begin in (start, calibrated(start)):
        out = with_calibration(begin, newer)
        now = out.truth.parameters
        for kind in errs:
            exact = getattr(true.inertial["one"], kind)
            expected = now[f"{kind}_scale/one"] * exact + now[f"{kind}_bias/one"]
            np.testing.assert_allclose(getattr(out.inertial["one"], kind), expected, atol=1e-12)
        np.testing.assert_allclose(now["accelerometer_drift/one"], 0.1 / 0.9)
        np.testing.assert_allclose(now["gyroscope_drift/one"], told["gyroscope_drift/one"])
        np.testing.assert_array_equal(now["accelerometer_bias/two"], told["accelerometer_bias/two"])
        excess = np.asarray(out.ranges.distance) - np.asarray(true.ranges.distance)
        np.testing.assert_allclose(excess[1::2], now["source_offset/b"], atol=1e-12)


@pytest.mark.parametrize("named", ["wall", "anchor/wall"])
def test_true_offsets_of_anchors_are_told_too(read, named: str) -> None:
    told = {"source_offset/anchor/wall": np.array(0.015)}
    truth = Truth(Trajectory(np.arange(2.0), np.zeros((2, 1))), "<mujoco/>", told)
    newer = Calibration(source_offset={named: SourceOffset(0.01)})
    out = with_calibration(replace(read, setup=Setup(), truth=truth), newer).truth.parameters
    assert set(out) == set(told)
    np.testing.assert_allclose(out["source_offset/anchor/wall"], 0.005, atol=1e-12)


@pytest.mark.parametrize("names", [("a", "b"), ("source/a", "b"), ("a", "source/b")])
def test_offsets_may_leave_out_the_prefix_of_the_site(true, read, names) -> None:
    named = replace(read.setup.calibration, source_offset={names[1]: SourceOffset(0.02)})
    same(calibrated(replace(read, setup=Setup(calibration=named))), true)
    # A recording's own sources may be named without it, too.
    sites = replace(read.ranges, source_names=names)
    out = calibrated(replace(read, ranges=sites))
    np.testing.assert_allclose(out.ranges.distance, true.ranges.distance, rtol=0, atol=1e-15)
    # Another site of that name is another source.
    anchors = replace(read.ranges, source_names=("anchor/a", "anchor/b"))
    out = calibrated(replace(read, ranges=anchors))
    np.testing.assert_array_equal(out.ranges.distance, read.ranges.distance)


def test_newer_offsets_replace_older_ones_however_they_are_named(true, read) -> None:
    for older, newer in (("source/b", "b"), ("b", "source/b")):
        wrong = Calibration(
            accelerometer={"one": ACCELEROMETER}, gyroscope={"one": GYROSCOPE},
            source_offset={older: SourceOffset(5.0), "source/c": SourceOffset(1.0)},
        )  # fmt: skip
        start = replace(read, setup=Setup(calibration=wrong))
        out = with_calibration(start, Calibration(source_offset={newer: SourceOffset(0.02)}))
        same(out, true)
        assert set(out.setup.calibration.source_offset) == {newer, "source/c"}


def test_nothing_to_apply_leaves_the_recording_as_it_is(true) -> None:
    assert calibrated(true) is true


def test_newer_figures_replace_older_ones_and_leave_the_rest(true, read) -> None:
    wrong = AxisCalibration(zero=(5.0, 5.0, 5.0))
    older = replace(
        read, setup=Setup(calibration=replace(CALIBRATION, accelerometer={"one": wrong}))
    )
    newer = Calibration(accelerometer={"one": ACCELEROMETER})
    for start in (older, calibrated(older)):
        out = with_calibration(start, newer, {"gyroscope": 0.5})
        same(out, true)
        assert out.setup.noise.gyroscope == 0.5
        assert out.setup.noise.accelerometer == true.setup.noise.accelerometer
        assert out.setup.calibration.accelerometer == {"one": ACCELEROMETER}
        assert out.setup.calibration.gyroscope == {"one": GYROSCOPE}

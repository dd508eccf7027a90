"""One sensor smoothed: a known motion with sensor errors, and the public BROAD trials."""

from __future__ import annotations

import os
from pathlib import Path

import jax
import numpy as np
import pytest

from mocap_jax import so3
from mocap_jax.errors import InputError
from mocap_jax.estimate import SingleImuOptions, SingleImuSolution, smooth_orientation
from mocap_jax.estimate.single_imu.intervals import long_runs
from mocap_jax.io.broad import read_broad
from mocap_jax.metrics import heading_free_error
from mocap_jax.recording import InertialStream

STEP, FINE = 0.01, 10
BIAS = np.array([0.004, -0.003, 0.005])
# Scale and cross-axis errors that would turn the heading by many degrees.
SCALE = np.array([[0.008, 0.0, 0.015], [0.0, -0.006, 0.0], [-0.015, 0.0, 0.004]])


def simulated(seconds: float = 40.0, *, rest: float = 6.0) -> tuple[InertialStream, np.ndarray]:
    """A hand that rests, turns and shakes a sensor, rests; and the orientation at sample ends."""
    h = STEP / FINE
    t = np.arange(round(seconds / h) + 1) * h
    fade = np.clip(np.minimum(t - rest, seconds - rest - t) / 2, 0, 1)
    envelope = (fade**3 * (10 - 15 * fade + 6 * fade**2))[:, None]
    swing = np.stack([1.2 * np.sin(2.1 * t), 1.5 * np.sin(1.7 * t + 1), 6 * np.sin(0.9 * t)], 1)
    place = 0.15 * np.stack([np.sin(3 * t), np.sin(2.6 * t + 2), np.cos(3.7 * t)], 1)
    R = np.asarray(so3.exp(envelope * swing))
    middle = so3.matmul3(np.swapaxes(R[:-1], 1, 2), R[1:])
    rate = np.asarray(jax.vmap(so3.log)(middle)) / h
    velocity = np.gradient(envelope * place, h, axis=0)
    gain = np.diff(velocity, axis=0) / h + np.array([0, 0, 9.81])
    force = np.einsum("tji,tj->ti", (R[:-1] + R[1:]) / 2, gain)
    rate, force = (x.reshape(-1, FINE, 3).mean(axis=1) for x in (rate, force))
    noise = np.random.default_rng(3).normal(size=(2, *rate.shape))
    rate = rate + rate @ SCALE.T + BIAS + 1e-3 * noise[0]
    force = force + 0.03 * noise[1]
    time = (np.arange(len(rate)) + 0.5) * STEP
    stream = InertialStream(time, force, rate, np.full((len(rate), 4), np.nan))
    return stream, np.asarray(so3.quat_from_matrix(R[FINE::FINE]))


def tilt_and_heading_deg(solution: SingleImuSolution) -> tuple[float, float]:
    """Stated standard deviations, RMS over the knots [deg]."""
    variance = (solution.orientation_std**2).mean(axis=0)
    return tuple(np.rad2deg(np.sqrt([variance[:2].sum(), variance[2]])))


def rms_deg(angle: np.ndarray) -> float:
    return float(np.rad2deg(np.sqrt((angle**2).mean())))


def test_errors_of_the_gyroscope_are_found() -> None:
    stream, truth = simulated()
    solution = smooth_orientation(stream)
    assert solution.status.ok
    error = heading_free_error(solution.quaternion, truth)
    # Tilt as well as the accelerometer's bias can be told from 28 s of motion, as it says itself.
    tilt_std, heading_std = tilt_and_heading_deg(solution)
    assert rms_deg(error.inclination) < min(2.5 * tilt_std, 0.5)
    assert rms_deg(error.heading) < min(2.5 * heading_std, 1.0)
    # The same with the errors not among the unknowns: what it is for.
    without = smooth_orientation(stream, SingleImuOptions(gyroscope_scale_sigma=1e-6))
    worse = heading_free_error(without.quaternion, truth)
    assert rms_deg(worse.heading) > 3 * rms_deg(error.heading)
    found, std = (x["gyroscope_scale"] for x in (solution.calibration, solution.calibration_std))
    np.testing.assert_array_less(np.abs(found - SCALE), 4 * std + 5e-4)
    assert std.max() < 0.01
    # Rest at both ends, found and used.
    assert (
        solution.still[:10].all() and solution.still[-10:].all() and not solution.still[20:60].any()
    )
    np.testing.assert_allclose(solution.gyroscope_bias[0], BIAS, atol=2e-4)
    np.testing.assert_allclose(solution.time, stream.time + STEP / 2)


def test_heading_is_no_part_of_the_answer() -> None:
    """Stated uncertainty of heading grows from nothing at the start; that of tilt stays."""
    stream, _ = simulated(20.0)
    std = smooth_orientation(stream).orientation_std
    assert std[0, 2] < 2e-4 and std[-1, 2] > 5 * std[0, 2]
    assert std[:, :2].max() < np.deg2rad(1.0)


def test_motion_without_rest_and_short_gaps() -> None:
    stream, truth = simulated(24.0, rest=0.0)
    cut = slice(300, 2100)
    gyroscope = np.array(stream.gyroscope[cut])
    gyroscope[700:703] = np.nan
    moving = InertialStream(
        stream.time[cut], stream.accelerometer[cut], gyroscope, stream.orientation[cut]
    )
    solution = smooth_orientation(moving)
    assert not solution.still.any()
    error = heading_free_error(solution.quaternion, truth[cut])
    tilt_std, heading_std = tilt_and_heading_deg(solution)
    assert rms_deg(error.inclination) < min(2.5 * tilt_std, 1.0)
    assert rms_deg(error.heading) < min(2.5 * heading_std, 3.0)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda t, g: (t[:50], g[:50]), "at least two intervals"),
        (lambda t, g: (np.where(t > 1, t + 1, t), g), "equal distances"),
        (lambda t, g: (t, np.where((t[:, None] > 2) & (t[:, None] < 3), np.nan, g)), "missing"),
    ],
)  # fmt: skip
def test_what_cannot_be_smoothed_is_refused(spoil, message: str) -> None:
    time = np.arange(500) * STEP
    time, gyroscope = spoil(time, np.zeros((500, 3)))
    force = np.tile([0, 0, 9.81], (len(time), 1))
    with pytest.raises(InputError, match=message):
        smooth_orientation(InertialStream(time, force, gyroscope, np.full((len(time), 4), np.nan)))


def test_options_are_positive() -> None:
    with pytest.raises(InputError, match="reach"):
        SingleImuOptions(reach=0.0)


def test_long_runs() -> None:
    flags = np.array([1, 1, 0, 1, 1, 1, 0, 0, 1], bool)
    np.testing.assert_array_equal(np.flatnonzero(long_runs(flags, 3)), [3, 4, 5])


# VQF 2.1.2 on the same trials, no magnetometer [deg].
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "vqf"),
    [
        ("02_undisturbed_slow_rotation_B", 0.56),
        ("07_undisturbed_fast_rotation_B", 1.49),
        ("21_undisturbed_fast_combined", 3.95),
    ],
)  # fmt: skip
def test_beside_vqf(shared_data: Path, name: str, vqf: float) -> None:
    file = shared_data / "broad" / f"{name}.mat"
    if not os.path.isfile(file):
        pytest.skip(f"{file} is absent")
    trial = read_broad(file)
    solution = smooth_orientation(trial.inertial)
    assert solution.status.ok
    error = heading_free_error(solution.quaternion[trial.scored], trial.reference[trial.scored])
    assert rms_deg(error.total) < min(vqf + 0.1, 1.6)

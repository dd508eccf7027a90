"""Model errors grow with the motion, and only with the motion."""

import dataclasses

import numpy as np
import pytest
from synthetic import small_body

from mocap_jax.estimate.sequence.adapt import _kept
from mocap_jax.estimate.sequence.variances import variances
from mocap_jax.estimate.shared_joints import shared_joints
from mocap_jax.estimate.whole_sequence_options import NoiseOptions
from mocap_jax.measurement import FrameData
from mocap_jax.recording import NoiseFigures

RATE, FRAMES = 100.0, 400
MODEL = NoiseOptions(lever_arm_sigma=0.0)
NOISE = NoiseFigures()


def readings(accelerometer: np.ndarray, gyroscope: np.ndarray) -> FrameData:
    """One sensor's readings (t, 3) on a uniform grid, and one range a frame."""
    ones = np.ones((FRAMES, 1))
    return FrameData(
        np.arange(FRAMES) / RATE, np.asarray(1 / RATE), accelerometer[:, None], gyroscope[:, None],
        np.full((FRAMES, 1, 4), np.nan), ones, ones, 0 * ones.astype(int), 0 * ones.astype(int),
        0 * ones, np.full((FRAMES, 3), np.nan), np.full((FRAMES, 4), np.nan), ("s",), (0,),
    )  # fmt: skip


def model_errors(accelerometer: np.ndarray, gyroscope: np.ndarray, model=MODEL):
    data = readings(accelerometer, gyroscope)
    found = variances(data, accelerometer[:, None], gyroscope[:, None], NOISE, model)
    return {kind: (declared[:, 0], errors[:, 0]) for kind, (declared, errors) in found.items()}


def wave(amplitude: float, hertz: float) -> np.ndarray:
    turn = 2 * np.pi * hertz * np.arange(FRAMES) / RATE
    return amplitude * np.stack([np.sin(turn), np.cos(turn), 0 * turn], axis=1)


def test_noise_alone_leaves_the_floor():
    # So loud that, not taken off, it would look like a third of a timing error's variance.
    rng = np.random.default_rng(0)
    noise = rng.standard_normal((2, FRAMES, 3))
    loud = {"accelerometer": 0.1, "gyroscope": 0.02}
    data = readings(9.81 + 0.1 * noise[0], 0.02 * noise[1])
    found = variances(
        data,
        np.asarray(data.accelerometer),
        np.asarray(data.gyroscope),
        NoiseFigures(**loud),
        MODEL,
    )
    for kind, floor in (
        ("accelerometer", MODEL.accelerometer_model), ("gyroscope", MODEL.gyroscope_model),
    ):  # fmt: skip
        taken_off = 3 * (MODEL.lag * loud[kind] * RATE) ** 2 / 2
        excess = found[kind][1].mean() - floor**2
        assert abs(excess) < 0.25 * taken_off
    np.testing.assert_allclose(found["range"][1], MODEL.range_model**2)


@pytest.mark.parametrize("hertz", [1.0, 3.0])
def test_a_timing_error_turns_slopes_into_errors(hertz):
    # Of vectors that turn at a steady rate the slope is constant: 2 pi f times the length.
    found = model_errors(wave(20.0, hertz), wave(4.0, hertz))
    omega, inner = 2 * np.pi * hertz, slice(30, -30)
    for kind, length, floor in (
        ("accelerometer", 20.0, MODEL.accelerometer_model),
        ("gyroscope", 4.0, MODEL.gyroscope_model),
    ):
        expected = np.hypot(floor, MODEL.lag * omega * length)
        np.testing.assert_allclose(np.sqrt(found[kind][1][inner]), expected, rtol=0.02)


def test_lever_arms_err_by_angular_motion_only():
    model = dataclasses.replace(MODEL, lever_arm_sigma=0.01, lag=0.0, accelerometer_model=0.0)
    spin = np.tile([0.0, 0.0, 10.0], (FRAMES, 1))
    steady = model_errors(np.zeros((FRAMES, 3)), spin, model)["accelerometer"][1]
    np.testing.assert_allclose(np.sqrt(steady), 0.01 * 10.0**2, rtol=1e-6)
    still = model_errors(wave(5.0, 1.0), np.zeros((FRAMES, 3)), model)["accelerometer"][1]
    np.testing.assert_allclose(still, 0.0, atol=1e-9)


def test_what_is_missing_has_no_information_and_spoils_nothing():
    force, rate = wave(20.0, 1.0), wave(4.0, 1.0)
    whole = model_errors(force, rate)["accelerometer"][1]
    force[200:210], rate[300] = np.nan, np.nan
    found = model_errors(force, rate)
    # The stencil of an acceleration spans three frames.
    np.testing.assert_array_equal(
        np.flatnonzero(np.isinf(found["accelerometer"][0])),
        [0, *range(199, 211), FRAMES - 1],
    )
    np.testing.assert_array_equal(np.flatnonzero(np.isinf(found["gyroscope"][0])), [300])
    assert np.isinf(found["orientation"][0]).all()
    # Bridged by a straight line, a gap hardly changes how fast the motion around it counts.
    np.testing.assert_allclose(found["accelerometer"][1], whole, rtol=0.15)
    assert all(np.isfinite(errors).all() for _, errors in found.values())


def test_joints_that_boards_see_only_together():
    body = small_body()
    site = body.topology.site_index
    pelvis, upper, fore = (site(n) for n in ("pelvis", "upper_arm", "forearm"))
    assert not shared_joints(body, (pelvis, upper, fore)).any()
    # Without the board on the upper arm, shoulder and elbow (five) show as one rotation.
    np.testing.assert_array_equal(
        shared_joints(body, (pelvis, fore)), [False] * 6 + [True] * (body.nv - 6)
    )
    # A root that moves freely is nobody's share.
    assert not shared_joints(body, (fore,))[:6].any()


def test_margin_only_where_most_boards_err():
    assert _kept(np.array([0.0, 0.0, 0.1]), 8.0) == (0.0, 0.0, 0.1)
    assert _kept(np.array([0.1, 0.05, 0.2]), 8.0) == (0.8, 0.4, 1.0)
    # Boards without readings of a kind have no say.
    assert _kept(np.array([0.0, np.nan, np.nan, 0.0, 0.1]), 8.0) == (0.0, 1.0, 1.0, 0.0, 0.1)

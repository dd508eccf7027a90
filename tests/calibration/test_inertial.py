"""Zeros and slopes from simulated calibration recordings of known errors."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from calibration_rig import LAB, UP, six_positions, truth, turntable

from mocap_jax.calibration import (
    AccelerometerOptions,
    GyroscopeOptions,
    calibrate_accelerometer,
    calibrate_gyroscope,
)
from mocap_jax.errors import InputError
from mocap_jax.recording import Recording, with_calibration

CASES = {
    "accelerometer": (six_positions, calibrate_accelerometer, 9.81),
    "gyroscope": (turntable, calibrate_gyroscope, 45 * 2 * np.pi / 60),
}


@pytest.mark.parametrize("kind", CASES)
def test_zeros_and_slopes_are_found_within_what_is_stated(kind) -> None:
    record, calibrate, length = CASES[kind]
    recording = record()
    found = calibrate([recording])
    assert set(found.sensors) == {"straight", "turned"} and not found.skipped
    scores = []
    for board, fit in found.sensors.items():
        zero, slope = truth(recording, kind, board)
        c = fit.calibration
        assert {p.direction for p in fit.plateaus} == set(UP)
        assert np.abs(np.subtract(c.zero, zero)).max() < 4e-4 * length
        assert np.abs(np.subtract(c.slope, slope)).max() < 4e-4
        # Far better than axes that are taken for upright, which lean by some degrees.
        assert np.abs(np.diag(fit.cross_axis) - slope).max() > 1e-3
        reading = np.array(c.slope_sigma)
        if kind == "gyroscope":  # the table's accuracy is no error here
            assert (reading >= 0.001 * np.array(c.slope) * 0.99).all()
            reading = np.sqrt(reading**2 - (0.001 * np.array(c.slope)) ** 2)
        scores += [np.subtract(c.zero, zero) / c.zero_sigma]
        scores += [np.subtract(c.slope, slope) / reading]
    assert 0.3 < np.sqrt(np.mean(np.square(scores))) < 2.0


@pytest.mark.parametrize("kind", CASES)
def test_corrected_readings_have_the_true_length(kind) -> None:
    record, calibrate, length = CASES[kind]
    other = record(seed=0, lean=8.0)  # the same sensors, held otherwise
    found = calibrate([record()])
    corrected = with_calibration(other, found.calibration)
    again = calibrate([corrected])  # of the readings before
    for board, fit in calibrate([other]).sensors.items():
        np.testing.assert_allclose(
            again.sensors[board].calibration.slope, fit.calibration.slope, rtol=0, atol=1e-12
        )
        plateaus = np.array([p.mean for p in fit.plateaus])
        before = np.linalg.norm(plateaus, axis=1) / length - 1
        c = found.sensors[board].calibration
        after = np.linalg.norm((plateaus - c.zero) / c.slope, axis=1) / length - 1
        assert np.abs(after).max() < 1e-3 < 5e-3 < np.abs(before).max()


def test_positions_may_be_spread_over_recordings() -> None:
    names = tuple(UP)
    parts = [six_positions(names[:3]), six_positions(names[3:])]
    found = calibrate_accelerometer(parts)
    for board, fit in found.sensors.items():
        zero, slope = truth(parts[0], "accelerometer", board)
        assert [p.place for p in fit.plateaus] == ["1"] * 3 + ["2"] * 3
        np.testing.assert_allclose(fit.calibration.slope, slope, atol=1e-3)
        np.testing.assert_allclose(fit.calibration.zero, zero, atol=1e-2)


def test_skewed_axes_show_as_cross_axis_response() -> None:
    straight = six_positions(lean=0.0)
    fit = calibrate_accelerometer([straight]).sensors["straight"]
    slope = truth(straight, "accelerometer", "straight")[1]
    np.testing.assert_allclose(fit.cross_axis, np.diag(slope), atol=1e-3)
    skew = np.eye(3)
    skew[0, 1] = 0.05  # the x axis responds to y
    stream = straight.inertial["straight"]
    bent = dataclasses.replace(stream, accelerometer=np.asarray(stream.accelerometer) @ skew.T)
    recording = dataclasses.replace(straight, inertial={"straight": bent})
    found = calibrate_accelerometer([recording]).sensors["straight"].cross_axis
    assert found[0, 1] == pytest.approx(0.05 * slope[1], abs=1e-3)
    assert abs(found[1, 0]) < 1e-3


def test_what_is_missing_is_named() -> None:
    with pytest.raises(InputError, match="no still position.* -x, .y, -y; found: .z at .*") as e:
        calibrate_accelerometer([six_positions(("+z", "-z", "+x"))])
    assert "\n" not in str(e.value)
    with pytest.raises(InputError, match=r"no steady turn about \+x, -x, .*; found: none"):
        calibrate_gyroscope([six_positions()])
    with pytest.raises(InputError, match="no steady turn"):
        calibrate_gyroscope([turntable()], GyroscopeOptions(rpm=33.3))
    with pytest.raises(InputError, match="no still position"):
        calibrate_accelerometer([six_positions()], AccelerometerOptions(gravity=1.62))


def test_one_board_without_all_positions_does_not_hinder_the_others() -> None:
    good = six_positions()
    silent = dataclasses.replace(
        good.inertial["turned"],
        accelerometer=np.full_like(good.inertial["turned"].gyroscope, np.nan),
    )
    found = calibrate_accelerometer(
        [dataclasses.replace(good, inertial=good.inertial | {"turned": silent})]
    )
    assert set(found.sensors) == {"straight"} and "found: none" in found.skipped["turned"]


def test_boards_without_gyroscopes_and_lost_samples_do() -> None:
    good = six_positions()
    random = np.random.default_rng(0)
    stream = good.inertial["straight"]
    force = np.array(stream.accelerometer)
    force[random.random(len(force)) < 0.05] = np.nan
    bare = dataclasses.replace(stream, accelerometer=force, gyroscope=np.full_like(force, np.nan))
    recording: Recording = dataclasses.replace(good, inertial={"straight": bare})
    fit = calibrate_accelerometer([recording]).sensors["straight"]
    np.testing.assert_allclose(
        fit.calibration.slope, truth(good, "accelerometer", "straight")[1], atol=1e-3
    )


def test_more_than_six_positions_state_their_disagreement() -> None:
    many = [six_positions(seed=0), six_positions(seed=0, lean=20.0)]
    fit = calibrate_accelerometer(many).sensors["straight"]
    slope = truth(many[0], "accelerometer", "straight")[1]
    assert len(fit.plateaus) > 8
    assert 0 < fit.residual < 5e-3
    assert np.abs(np.subtract(fit.calibration.slope, slope)).max() < 3e-4
    assert LAB.scale > 10 * max(fit.calibration.slope_sigma)

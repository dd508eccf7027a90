"""Noise of simulated boards that lie still."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from calibration_rig import left_alone, six_positions

from mocap_jax.calibration import NoiseCalibrationOptions, calibrate_noise
from mocap_jax.errors import InputError
from mocap_jax.report import allan_figure

RATE = 140.0


@pytest.mark.parametrize("loss", [0.0, 0.02])
def test_white_noise_is_what_the_simulator_gave(loss) -> None:
    found = calibrate_noise(left_alone(loss=loss))
    for kind, sigma in (("accelerometer", 0.04), ("gyroscope", 0.004)):
        assert set(found.sensors[kind]) == {"straight", "turned"}
        assert found.per_sample[kind] == pytest.approx(sigma, rel=0.03)
        for noise in found.sensors[kind].values():
            assert noise.missing == pytest.approx(loss, abs=0.012)
            assert noise.rate_hz == pytest.approx(RATE, rel=1e-6)
            np.testing.assert_allclose(noise.fit.white, sigma / np.sqrt(RATE), rtol=0.06)
    figures = found.calibration.gyroscope_noise["turned"]
    assert figures.white == pytest.approx((0.004 / np.sqrt(RATE),) * 3, rel=0.06)


def test_wandering_zeros_are_seen() -> None:
    found = calibrate_noise(left_alone(200.0, white=0.5, walk=3e-3))
    for kind, walk in (("accelerometer", 3e-3), ("gyroscope", 3e-4)):
        size = [noise.fit.random_walk for noise in found.sensors[kind].values()]
        assert np.median(size) == pytest.approx(walk, rel=0.2)
        # What a sample deviates by does not grow with the length of the recording.
        white = {"accelerometer": 0.01, "gyroscope": 0.001}[kind]
        assert found.per_sample[kind] == pytest.approx(white, rel=0.03)


def test_only_what_lies_still_for_long_enough_is_used() -> None:
    with pytest.raises(InputError, match="longest still interval lasts .* at least 60 s") as error:
        calibrate_noise(six_positions())
    assert "sensor 'straight' (and 1 more)" in str(error.value)
    short = "less than 2 s of 3.. s, not counting its first and last 1 s, .* at least 2 s"
    with pytest.raises(InputError, match=short):
        calibrate_noise(left_alone(3.0), NoiseCalibrationOptions(shortest_s=1.0))
    with pytest.raises(InputError, match="at least 300 s are needed"):
        calibrate_noise(left_alone(), NoiseCalibrationOptions(shortest_s=300))
    with pytest.raises(InputError, match="% of the accelerometer's samples are missing"):
        calibrate_noise(left_alone(loss=0.02), NoiseCalibrationOptions(most_missing=0.001))


def broken(kind: str, readings: str, board: str = "straight"):
    """The boards that lie still, one sensor of which is stuck or loses every other sample."""
    recording = left_alone()
    stream = recording.inertial[board]
    values = np.array(getattr(stream, kind))
    if readings == "stuck":
        values[:, 1] = values[0, 1]
    else:
        values[::2] = np.nan
    stream = dataclasses.replace(stream, **{kind: values})
    return dataclasses.replace(recording, inertial=recording.inertial | {board: stream})


@pytest.mark.parametrize("kind", ["accelerometer", "gyroscope"])
@pytest.mark.parametrize(
    ("readings", "words"), [("stuck", "same all the time on y"), ("lossy", "samples are missing")]
)
def test_a_broken_sensor_is_left_out_and_the_other_of_its_board_is_used(
    kind, readings, words
) -> None:
    found = calibrate_noise(broken(kind, readings))
    other = {"accelerometer": "gyroscope", "gyroscope": "accelerometer"}[kind]
    assert set(found.sensors[kind]) == {"turned"}
    assert set(found.sensors[other]) == {"straight", "turned"}
    assert list(found.skipped) == [f"straight/{kind}"]
    assert words in found.skipped[f"straight/{kind}"] and kind in found.skipped[f"straight/{kind}"]


def test_constant_readings_alone_give_no_noise() -> None:
    recording = broken("gyroscope", "stuck")
    still = {
        name: dataclasses.replace(
            s, accelerometer=np.full_like(s.accelerometer, 3.0),
            gyroscope=np.full_like(s.gyroscope, np.nan),
        )
        for name, s in recording.inertial.items()
    }  # fmt: skip
    with pytest.raises(InputError, match=r"'straight/accelerometer' \(and 1 more\): .* on x, y, z"):
        calibrate_noise(dataclasses.replace(recording, inertial=still))


def test_a_knock_ends_the_interval() -> None:
    recording = left_alone(200.0, white=0.5, walk=3e-3)
    stream = recording.inertial["straight"]
    force = np.array(stream.accelerometer)
    force[(np.asarray(stream.time) > 60) & (np.asarray(stream.time) < 60.2)] += [0, 5, 0]
    knocked = dataclasses.replace(stream, accelerometer=force)
    found = calibrate_noise(dataclasses.replace(recording, inertial={"straight": knocked}))
    assert found.sensors["accelerometer"]["straight"].duration == pytest.approx(139, abs=3)


def test_the_picture_names_the_processes() -> None:
    figure = allan_figure(calibrate_noise(left_alone(200.0, white=0.5, walk=3e-3)))
    panels = figure.axes
    assert [p.get_title(loc="left").split(",")[0] for p in panels] == ["accelerometer", "gyroscope"]
    for panel in panels:
        texts = " ".join(t.get_text() for t in panel.get_legend().get_texts())
        assert "white noise" in texts and "random walk" in texts
        assert "averaging time [s]" in panel.get_xlabel() and "[" in panel.get_ylabel()

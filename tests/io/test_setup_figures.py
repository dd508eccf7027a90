"""Noise and calibration in set-up files: what is there stays."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from io_samples import SENSORS, random_calibration, random_recording, random_setup

from mocap_jax.errors import InputError
from mocap_jax.io import (
    SetupFigures,
    read_recording,
    read_setup,
    read_setup_figures,
    update_setup_file,
    write_recording,
    write_setup,
)
from mocap_jax.recording import (
    AxisCalibration,
    AxisNoise,
    Calibration,
    SourceOffset,
    uncalibrated,
)

FIGURES = SetupFigures(
    Calibration(
        accelerometer={"new": AxisCalibration(zero=(1.0, 2.0, 3.0))},
        source_offset={"source/belly": SourceOffset(0.5)},
        gyroscope_noise={"new": AxisNoise((1.0, 2.0, 3.0))},
    ),
    {"gyroscope": 0.25},
)


def test_a_set_up_keeps_all_that_is_not_new(tmp_path) -> None:
    file = tmp_path / "s.toml"
    write_setup(file, random_setup())
    update_setup_file(file, FIGURES)
    before, after = random_setup(), read_setup(file)
    assert after.noise == replace(before.noise, gyroscope=0.25)
    assert after.calibration == before.calibration.updated(FIGURES.calibration)
    assert replace(after, noise=before.noise, calibration=before.calibration) == before
    assert list(tmp_path.iterdir()) == [file]


def test_a_new_file_holds_the_figures_alone(tmp_path) -> None:
    file = tmp_path / "s.toml"
    update_setup_file(file, FIGURES)
    assert read_setup_figures(file) == FIGURES
    assert set(tomllib.loads(file.read_text())) == {"noise", "calibration"}
    update_setup_file(file, SetupFigures(noise={"range": 0.125}))
    assert read_setup_figures(file).noise == {"gyroscope": 0.25, "range": 0.125}
    assert read_setup_figures(file).calibration == FIGURES.calibration


def test_a_suit_and_its_comments_stay(tmp_path) -> None:
    file = tmp_path / "suit.toml"
    suit = '# mine\n[[boards]]\nname = "b"  # the first\nsegment = "T8"\nposition = [0, 0, 0]\n'
    file.write_text(suit)
    update_setup_file(file, FIGURES)
    assert file.read_text().startswith(suit)
    assert read_setup_figures(file) == FIGURES


@pytest.mark.parametrize(("text", "expected"), [
    ("x = ", "not valid TOML"),
    ("speed_of_sond = 3.0", "unknown key 'speed_of_sond'; valid: speed_of_sound"),
    ("[noise]\ngyro = 0.1", r"unknown key in \[noise\] 'gyro'"),
    ("[calibration.gyro.a]\nzero = [0, 0, 0]", r"unknown key in \[calibration\] 'gyro'"),
    ("[calibration.gyroscope.a]\nzero = [0, 0]", "'calibration.gyroscope.a.zero' must be a list"),
    ("[calibration.gyroscope.a]\nslope = [1, 0, 1]", r"slope\[1\]' must be greater than 0"),
    ("[calibration.gyroscope]\na = 1", "'calibration.gyroscope.a' must be a table"),
    ("[calibration.source_offset.a]\nsigma = 1", "lacks 'offset'"),
    ("[calibration.gyroscope_noise.a]", "lacks 'white'"),
    ("[calibration]\napplied = 1", "must be true or false"),
])  # fmt: skip
def test_wrong_files_are_named_and_left_alone(tmp_path, text, expected) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(text)
    for use in (read_setup_figures, lambda f: update_setup_file(f, FIGURES)):
        with pytest.raises(InputError, match=rf"bad\.toml: .*{expected}") as caught:
            use(file)
        assert "\n" not in str(caught.value)
    assert file.read_text() == text and list(tmp_path.iterdir()) == [file]


def test_a_recording_is_read_corrected(body, tmp_path) -> None:
    recording = random_recording(body)
    raw = uncalibrated(recording)
    assert not np.allclose(
        raw.inertial[SENSORS[1]].gyroscope, recording.inertial[SENSORS[1]].gyroscope
    )
    write_recording(tmp_path / "raw.mcap", raw)
    read = read_recording(tmp_path / "raw.mcap")
    assert read.setup.calibration == random_calibration()
    np.testing.assert_allclose(
        read.inertial[SENSORS[1]].gyroscope, recording.inertial[SENSORS[1]].gyroscope,
        rtol=1e-12, atol=1e-12,
    )  # fmt: skip


def test_anchors_of_a_suit_are_no_fault(tmp_path) -> None:
    file = tmp_path / "suit.toml"
    file.write_text('[[anchors]]\nname = "door"\nposition = [1, 0, 2]\n[noise]\nrange = 0.01\n')
    assert read_setup_figures(file).noise == {"range": 0.01}
    update_setup_file(file, FIGURES)
    assert tomllib.loads(file.read_text())["anchors"][0]["name"] == "door"

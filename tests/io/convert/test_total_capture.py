"""TotalCapture's .sensors files, whole, broken off and wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from known_motion import known, same_rotations

from mocap_jax.errors import InputError
from mocap_jax.io.convert import read_source, recording_of, worn_sensors

NAMES = ("Head", "Sternum", "L_LowArm")


def write(file: Path, n: int = 40, *, aux: bool = True) -> list:
    motions = [known(n, 60.0, seed) for seed in range(len(NAMES))]
    lines = [f"{len(NAMES)}\t{n}"]
    for k in range(n):
        lines.append(str(k + 1))
        for name, m in zip(NAMES, motions, strict=True):
            parts = [m.orientation[k], m.force[k]]
            parts += [m.rate[k], m.field[k] / 5e-5] if aux else []
            lines.append(f"{name} " + " ".join(f"{x:.8f}" for x in np.concatenate(parts)))
    file.write_text("\n".join(lines) + "\n")
    return motions


def converted(file: Path):
    source = read_source(file)
    return source, recording_of(source, worn_sensors(source, None))


@pytest.mark.parametrize("aux", [True, False])
def test_round_trip(tmp_path, aux):
    motions = write(tmp_path / "a.sensors", aux=aux)
    source, read = converted(tmp_path / "a.sensors")
    for name, motion in zip(NAMES, motions, strict=True):
        stream = read.inertial[name]
        np.testing.assert_allclose(stream.time, motion.time)
        np.testing.assert_allclose(stream.accelerometer, motion.force, atol=1e-7)
        assert same_rotations(stream.orientation, motion.orientation)
        if aux:
            np.testing.assert_allclose(stream.gyroscope, motion.rate, atol=1e-7)
            np.testing.assert_allclose(read.magnetic[name].field, motion.field, atol=1e-11)
    assert bool(source.remarks) is not aux and not read.salvage
    assert read.setup.provenance["segment/L_LowArm"] == "LeftForeArm"


@pytest.mark.parametrize("cut", [20, 60, 250, 330])
def test_broken_off_file_is_read_up_to_its_last_whole_frame(tmp_path, cut):
    file = tmp_path / "a.sensors"
    write(file)
    file.write_text(file.read_text()[:-cut])
    _, read = converted(file)
    count = len(read.inertial["Head"].time)
    assert count in (38, 39) and f"breaks off after {count} whole frames" in read.salvage[0]


def test_missing_frames_are_gaps(tmp_path):
    file = tmp_path / "a.sensors"
    write(file)
    lines = file.read_text().splitlines()
    del lines[1 + 4 * 9 : 1 + 4 * 10]
    file.write_text("\n".join(lines))
    _, read = converted(file)
    stream = read.inertial["Head"]
    assert len(stream.time) == 40 and np.isnan(stream.accelerometer[9]).all()


@pytest.mark.parametrize(
    "line, text, words",
    [
        (1, "x", "first line must hold the number of sensors and of frames"),
        (6, "Head", "expected a frame number"),
        (7, "Hand 1 0 0 0", "line 7: expected sensor Head with 13 numbers"),
        (6, "1", "frame 1 follows frame 1"),
        (158, "4000000000", "counts 4000000000 samples but holds 40"),
    ],
)
def test_wrong_files_are_refused(tmp_path, line, text, words):
    file = tmp_path / "a.sensors"
    write(file)
    lines = file.read_text().splitlines()
    lines[line - 1] = text
    file.write_text("\n".join(lines))
    with pytest.raises(InputError, match=words):
        converted(file)

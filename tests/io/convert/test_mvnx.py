"""MVNX of versions 4 (free accelerations) and 3 (sensor readings), whole and broken off."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from known_motion import known, same_rotations
from mvnx_files import LABELS, RATE, SEGMENTS, document

from mocap_jax.errors import InputError
from mocap_jax.io.convert import read_source, recording_of, worn_sensors


def converted(path: Path, text: str):
    path.write_text(text)
    source = read_source(path)
    return source, recording_of(source, worn_sensors(source, None))


@pytest.mark.parametrize("version", [3, 4])
def test_round_trip(tmp_path, version):
    source, read = converted(tmp_path / "a.mvnx", document(version=version))
    assert list(read.inertial) == list(LABELS)
    for seed, label in enumerate(LABELS):
        motion, stream = known(120, RATE, seed), read.inertial[label]
        np.testing.assert_allclose(stream.time, motion.time, atol=1e-9)
        np.testing.assert_allclose(stream.accelerometer, motion.force, atol=1e-7)
        np.testing.assert_allclose(stream.gyroscope, motion.rate, atol=1e-7)
        assert same_rotations(stream.orientation, motion.orientation)
        np.testing.assert_allclose(read.magnetic[label].field, motion.field, atol=1e-12)
    facts = read.setup.provenance
    assert ("turned into" in facts["gyroscope"]) == (version == 4)
    assert facts["sampling_rate_hz"] == RATE and read.subject == "P01"
    assert read.start_utc_ns == 1_700_000_000_123 * 10**6
    assert source.poses is not None and source.poses.position.shape == (120, len(SEGMENTS), 3)


def test_broken_off_file_is_read_up_to_its_last_whole_frame(tmp_path):
    text = document()
    _, read = converted(tmp_path / "a.mvnx", text[: int(0.7 * len(text))])
    count = len(read.inertial["T8"].time)
    assert 60 < count < 110
    assert read.salvage == (f"a.mvnx: breaks off after {count} frames.",)


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda t: "<other>" + t[21:], "not MVNX: the document is <other>"),
        (lambda t: t[:300], "not valid MVNX"),
        (lambda t: document(3, sensors=False), "no sensor data"),
        (lambda t: t.replace('type="normal"', 'type="tpose"'), "no frames of type 'normal'"),
        (lambda t: t.replace("<sensorMagneticField>", "<sensorMagneticField>1 ", 1),
         "frame 0: sensorMagneticField: has 10 numbers, expected 9"),
        (lambda t: t.replace("<sensorMagneticField>", "<sensorMagneticField>x", 1),
         "frame 0: sensorMagneticField: could not convert"),
        (lambda t: t.replace('time="33"', 'time="0"'), "time runs backwards|time repeats"),
    ],
)  # fmt: skip
def test_wrong_files_are_refused(tmp_path, change, words):
    with pytest.raises(InputError, match=words):
        converted(tmp_path / "a.mvnx", change(document(5)))

"""MVNX of versions 4 (free accelerations) and 3 (sensor readings), whole and broken off."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from known_motion import known, same_rotations

from mocap_jax.errors import InputError
from mocap_jax.io.convert import read_source, recording_of, worn_sensors

LABELS = ("Pelvis", "T8", "RightUpperLeg")
SEGMENTS = ("Pelvis", "L5", "L3", "T12", "T8", "RightUpperLeg")
RATE = 60.0


def numbers(values: np.ndarray) -> str:
    return " ".join(f"{x:.9f}" for x in np.ravel(values))


def document(n: int = 120, *, version: int = 4, aligned: bool = True, sensors: bool = True) -> str:
    motions = {label: known(n, RATE, seed) for seed, label in enumerate(LABELS)}
    offsets = np.arange(3 * len(SEGMENTS)).reshape(-1, 3) / 10
    one = np.tile([1.0, 0, 0, 0], (len(SEGMENTS), 1))
    frames = []
    if aligned:
        frames.append(
            f'<frame time="0" type="identity"><orientation>{numbers(one)}</orientation>'
            f"<position>{numbers(offsets)}</position></frame>"
        )
    for k in range(n):
        parts = []
        stack = lambda what: np.stack([getattr(m, what)[k] for m in motions.values()])  # noqa: B023, E731
        if sensors:
            parts.append(("sensorOrientation", stack("orientation")))
            parts.append(("sensorMagneticField", stack("field") / 5e-5))
        if sensors and version == 4:
            parts.append(("sensorFreeAcceleration", stack("free_world")))
        elif sensors:
            parts.append(("sensorAcceleration", stack("force")))
            parts.append(("sensorAngularVelocity", stack("rate")))
        turned = np.zeros((len(SEGMENTS), 3))
        for label, motion in motions.items():
            turned[SEGMENTS.index(label)] = motion.matrices[k] @ motion.rate[k]
        parts += [("orientation", one), ("position", offsets + k), ("angularVelocity", turned)]
        body = "".join(f"<{tag}>{numbers(v)}</{tag}>" for tag, v in parts)
        frames.append(f'<frame time="{round(k / RATE * 1000)}" index="{k}" type="normal">{body}'
                      "</frame>")  # fmt: skip
    return (
        f'<?xml version="1.0"?><mvnx version="{version}" xmlns="http://www.xsens.com/mvn/mvnx">'
        f'<subject label="P01" frameRate="{RATE:g}" recDateMSecsSinceEpoch="1700000000123">'
        "<segments>" + "".join(f'<segment label="{s}"/>' for s in SEGMENTS) + "</segments>"
        "<sensors>" + "".join(f'<sensor label="{s}"/>' for s in LABELS) + "</sensors>"
        "<frames>" + "".join(frames) + "</frames></subject></mvnx>"
    )


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

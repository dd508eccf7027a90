"""`mocap-jax calibrate mounting`: two sensors beside an elbow, headings unknown."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.cli import main
from mocap_jax.io import read_recording, write_recording
from mocap_jax.recording import InertialStream, Recording, SensorSpec, Setup

RATE_HZ, SECONDS = 60.0, 15.0
XML = """<mujoco><compiler angle="radian"/><worldbody><body name="trunk" pos="0 0 1">
<freejoint name="root"/><geom size="0.1"/><body name="arm" pos="0 0 0.3"><joint name="elbow"
axis="0 1 0" range="0 2.6" limited="true"/><geom size="0.1" pos="0 0 -0.2"/></body></body>
</worldbody></mujoco>"""
MOUNTED = {"s1": Rotation.from_rotvec([0.4, -1.0, 0.3]), "s2": Rotation.from_rotvec([1.2, 0.2, 2])}
PLACES = {"s1": np.array([0.02, 0.1, -0.15]), "s2": np.array([-0.03, 0.02, -0.2])}
HEADINGS = {"s1": 0.8, "s2": -2.1}


def still_then_moving() -> Recording:
    """Elbow and trunk at rest for two seconds, then moving; accelerations by differences."""
    time = np.arange(int(RATE_HZ * SECONDS)) / RATE_HZ
    share = np.clip((time - 2) / 2, 0, 1)
    share = (share**3 * (10 - 15 * share + 6 * share**2))[:, None]
    phases = np.array([0.3, 1.1, 2.0])
    joint = 0.3 * share * np.sin(2.5 * time[:, None] + phases)
    trunk = Rotation.from_rotvec(0.4 * share * np.sin(1.3 * time[:, None] + 2 * phases))
    elbow = (share[:, 0] * (1 - np.cos(2.1 * time)))[:, None] * [0.0, 1.0, 0.0]
    rotations = {"s1": trunk, "s2": trunk * Rotation.from_rotvec(elbow)}
    streams = {}
    for name, R in rotations.items():
        place, step = joint + R.apply(PLACES[name]), 1 / RATE_HZ
        acceleration = np.gradient(np.gradient(place, step, axis=0), step, axis=0)
        sensor = R * MOUNTED[name]
        force = sensor.inv().apply(acceleration + [0, 0, 9.81])
        rate = np.concatenate(
            [np.zeros((1, 3)), (sensor[:-1].inv() * sensor[1:]).as_rotvec() / step]
        )
        seen = Rotation.from_euler("z", -HEADINGS[name]) * sensor
        streams[name] = InertialStream(time, force, rate, seen.as_quat(scalar_first=True))
    setup = Setup(sensors=tuple(SensorSpec(n, n, RATE_HZ) for n in streams))
    return Recording(streams, None, None, {}, None, None, setup, None)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mounting")
    write_recording(folder / "raw.mcap", still_then_moving())
    (folder / "body.xml").write_text(XML)
    return folder


def arguments(folder: Path, *more: str) -> list[str]:
    return [
        "calibrate", "mounting", str(folder / "raw.mcap"), "--body", str(folder / "body.xml"),
        "-o", str(folder / "worn.mcap"), "--segment", "s1=trunk", "--segment", "s2=arm", *more,
    ]  # fmt: skip


def test_mounting_and_headings_come_out(folder: Path, capsys):
    code = main(arguments(folder, "--headings", "own", "--json", str(folder / "worn.json")))
    out = capsys.readouterr()
    assert code == 0, out.err
    assert "axes of elbow" in out.out and "s2" in out.out
    found = json.loads((folder / "worn.json").read_text())
    for name, heading in HEADINGS.items():
        sensor = found["sensors"][name]
        off = np.exp(1j * (np.deg2rad(sensor["heading_deg"]) - heading))
        assert abs(np.rad2deg(np.angle(off))) < 6, sensor
        assert sensor["heading_std_deg"] < 25 and sensor["misfit_deg"] < 6
        R = Rotation.from_matrix(sensor["R_segment_sensor"])
        assert np.rad2deg((R * MOUNTED[name].inv()).magnitude()) < 6
    worn = read_recording(folder / "worn.mcap")
    assert worn.body_xml is not None and worn.setup.rest is not None


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--headings", "magnetic"], "auto, own, common"),
        (["--facing", "s1"], "SENSOR:AXIS"),
        (["--facing", "s9:x"], "--facing: unknown sensor 's9'; valid: s1, s2"),
        (["--facing", "s1:up"], "--facing: unknown axis 'up'; valid: x"),
        (["--time", "99"], "--time: time 99 s is outside the recording; valid: 0.00 to 14.98 s"),
        (["--time", "10"], "--time: nobody is still"),
        (["--segment", "s3=arm"], "--segment: unknown sensor 's3'; valid: s1, s2"),
        (["--segment", "s1=Hat"], "--segment: unknown segment 'Hat'; valid: trunk, arm"),
        (["--pose", "lying"], "reference, declared"),
        (["--pose", "declared"], "declares no rest hold"),
        (["--segment", "s1"], "SENSOR=SEGMENT"),
        (["--height", "1.8"], "--body human"),
        (["-o", "worn.txt"], ".mcap"),
    ],
)
def test_wrong_input_is_one_line_that_names_the_choices(folder, capsys, more, message):
    code = main(arguments(folder, *more))
    error = capsys.readouterr().err
    assert code in (1, 2) and message in error and error.count("\n") == 1, error


def test_without_a_knee_or_elbow_somebody_has_to_say_where_it_faces(folder: Path, capsys):
    body = folder / "ball.xml"
    body.write_text(XML.replace('axis="0 1 0" range="0 2.6" limited="true"', 'type="ball"'))
    call = arguments(folder, "--body", str(body), "--headings", "own")
    assert main(call) == 1
    error = capsys.readouterr().err
    assert "raw.mcap: " in error and "say which axis of which sensor points forward" in error

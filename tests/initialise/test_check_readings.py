"""Wrong units, signs, quaternions and exchanged sensors are named, and sound data are not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.initialise import check_readings
from mocap_jax.recording import InertialStream, Recording, Setup

N, RATE = 1500, 100.0
SEGMENTS = {"pelvis": "Pelvis", "left_thigh": "LeftUpperLeg", "left_shank": "LeftLowerLeg",
            "right_thigh": "RightUpperLeg", "right_shank": "RightLowerLeg",
            "left_foot": "LeftFoot", "right_foot": "RightFoot"}  # fmt: skip
CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def stream(turn: Rotation, mounting: Rotation, heading: float, sway: np.ndarray) -> InertialStream:
    """Readings of a board on a segment; its filter's world is turned by a heading."""
    time = np.arange(N) / RATE
    R_world_sensor = turn * mounting
    step = (R_world_sensor[:-1].inv() * R_world_sensor[1:]).as_rotvec() * RATE
    # At samples, from the steps on both sides.
    rate = np.vstack([step[:1], 0.5 * (step[1:] + step[:-1]), step[-1:]])
    force = R_world_sensor.inv().apply(sway + [0.0, 0.0, 9.81])
    measured = Rotation.from_rotvec([0.0, 0.0, heading]) * R_world_sensor
    return InertialStream(time, force, rate, measured.as_quat(scalar_first=True))


@pytest.fixture(scope="module")
def walking() -> Recording:
    """Seven boards of a walker, mounted anyhow, each with a heading of its own."""
    rng = np.random.default_rng(4)
    t = np.clip(np.arange(N) / RATE - 2.0, 0.0, None)[:, None]

    def swing(x: float, y: float, z: float, hertz: float = 0.9, phase: float = 0.0) -> Rotation:
        """Turning to and fro about the three axes [rad], from rest on."""
        wave = np.sin(2 * np.pi * hertz * t + phase) - np.sin(phase)
        return Rotation.from_rotvec(np.array([x, y, z]) * wave)

    turns = {"pelvis": swing(0.05, 0.08, 0.25, phase=0.3) * swing(0.1, 0.0, 0.6, 0.13)}
    for side, sign, phase in (("left", 1, 0.0), ("right", -1, np.pi)):
        lift = swing(0.3 * sign, 0.6, 0.2, 0.47 + 0.17 * sign)
        thigh = turns["pelvis"] * swing(0.0, 0.5, 0.0, phase=phase) * lift
        turns[f"{side}_thigh"] = thigh
        shank = turns[f"{side}_shank"] = thigh * swing(0.05, 0.15, 0.0, phase=phase + 0.7)
        turns[f"{side}_foot"] = shank * swing(0.0, 0.1, 0.05, phase=phase + 1.4)
    inertial = {}
    for i, (name, turn) in enumerate(turns.items()):
        sway = rng.normal(size=3) * np.sin(2 * np.pi * (1 + 0.1 * i) * t) * 0.8
        inertial[name] = stream(turn, Rotation.random(random_state=i), 0.9 * i, sway)
    facts = {f"segment/{n}": s for n, s in SEGMENTS.items()}
    return Recording(inertial, None, None, {}, None, None, Setup(provenance=facts), None)


def changed(recording: Recording, **changes) -> Recording:
    """With a function applied to a kind of readings of every sensor."""
    out = {
        n: dataclasses.replace(s, **{k: f(getattr(s, k)) for k, f in changes.items()})
        for n, s in recording.inertial.items()
    }
    return dataclasses.replace(recording, inertial=out)


def test_sound_readings_have_no_findings(walking):
    check = check_readings(walking)
    assert check.ok and not check.sentences and not check.remarks, str(check)
    assert check.measures["pelvis"]["gravity"] == pytest.approx(9.81, abs=0.01)


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"accelerometer": lambda a: a / 9.81}, "accelerometer reads in g"),
        ({"accelerometer": lambda a: a * 9.81}, "accelerometer is 9.8 times too large"),
        ({"gyroscope": np.rad2deg}, "gyroscope reads in deg/s"),
        ({"gyroscope": np.deg2rad}, "gyroscope is 57 times too small"),
        ({"gyroscope": np.negative}, "gyroscope has the opposite sign"),
        ({"accelerometer": np.negative}, "gravity points down: the accelerometer has"),
        ({"orientation": lambda q: q * CONJUGATE}, "orientations look like world-to-sensor"),
        ({"orientation": lambda q: np.roll(q, -1, 1)}, "quaternions look like xyzw, read as wxyz"),
        ({"orientation": lambda q: np.roll(q, 1, 1)}, "quaternions look like wxyz, read as xyzw"),
        ({"orientation": lambda q: np.roll(q * CONJUGATE, -1, 1)},
         "quaternions look like xyzw and world-to-sensor"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_all_sensors_is_named_in_one_sentence(walking, changes, words):
    check = check_readings(changed(walking, **changes))
    named = [s for s in check.sentences if words in s]
    assert named and not check.exchanged, str(check)
    told = " ".join(named)
    assert all(sensor in told for sensor in SEGMENTS)
    assert all(len(texts) == 1 for texts in check.faults.values()), check.faults


@pytest.mark.parametrize("axis, turn", [("y", [-np.pi / 2, 0, 0]), ("x", [0, np.pi / 2, 0])])
def test_another_axis_up_is_named(walking, axis, turn):
    R_other_world = Rotation.from_rotvec(turn)
    other = lambda q: (R_other_world * Rotation.from_quat(q, scalar_first=True)).as_quat(  # noqa: E731
        scalar_first=True
    )
    check = check_readings(changed(walking, orientation=other))
    assert len(check.sentences) == 1 and f"has its {axis} axis up, not z" in check.sentences[0]


def test_a_board_that_turns_steadily_is_no_board_at_rest():
    """A foot turned about the vertical feels an even force; its rate is no offset."""
    time = np.arange(0, 14, 0.01)
    rate = np.zeros((len(time), 3))
    rate[:, 2] = 0.8 * (time < 3.0)
    for axis, frequency in enumerate((0.7, 0.5)):
        late = np.clip((time - 3.0) / 0.5, 0, 1)
        rate[:, axis] += 1.5 * late * np.sin(2 * np.pi * frequency * (time - 3.0))
    turn = Rotation.identity(len(time))
    for k in range(1, len(time)):
        turn[k] = turn[k - 1] * Rotation.from_rotvec(rate[k - 1] * 0.01)
    force = turn.inv().apply([0.0, 0.0, 9.80665])
    rng = np.random.default_rng(0)
    stream = InertialStream(
        time, force + 0.02 * rng.normal(size=force.shape),
        rate + 0.002 * rng.normal(size=rate.shape), np.full((len(time), 4), np.nan),
    )  # fmt: skip
    recording = Recording({"foot": stream}, None, None, {}, None, None, Setup(), None)
    check = check_readings(recording)
    assert check.ok and "No rest was found for foot" in check.remarks[0], str(check)
    rested = dataclasses.replace(stream, gyroscope=np.where(time[:, None] < 3.0, 0.0, rate))
    check = check_readings(dataclasses.replace(recording, inertial={"foot": rested}))
    assert not check.remarks


def test_gravity_removed_is_named(walking):
    moved = {
        n: dataclasses.replace(
            s,
            accelerometer=s.accelerometer
            - Rotation.from_quat(s.orientation, scalar_first=True).inv().apply([0, 0, 9.81]),
            orientation=np.full((N, 4), np.nan),
        )
        for n, s in walking.inertial.items()
    }
    check = check_readings(dataclasses.replace(walking, inertial=moved))
    assert all("gravity seems to be removed" in t[0] for t in check.faults.values()), str(check)


def test_orientations_that_fit_nothing_are_said_to(walking):
    rng = np.random.default_rng(0)
    wild = lambda q: q[rng.permutation(N)]  # noqa: E731
    check = check_readings(changed(walking, orientation=wild))
    assert all("disagree" in texts[0] for texts in check.faults.values()), str(check)


@pytest.mark.parametrize(
    "a, b",
    [("left_shank", "right_shank"), ("left_foot", "right_shank"), ("pelvis", "left_foot")],
)
def test_exchanged_sensors_are_named(walking, a, b):
    inertial = dict(walking.inertial)
    inertial[a], inertial[b] = inertial[b], inertial[a]
    check = check_readings(dataclasses.replace(walking, inertial=inertial))
    assert [set(group) for group in check.exchanged] == [{a, b}], str(check)


def test_gaps_and_absent_kinds_do_not_disturb(walking):
    def holes(values):
        values = np.array(values)
        values[300:330] = np.nan
        return values

    kinds = ("accelerometer", "gyroscope", "orientation")
    check = check_readings(changed(walking, **dict.fromkeys(kinds, holes)))
    assert check.ok, str(check)
    nothing = lambda values: np.full_like(values, np.nan)  # noqa: E731
    for kind in kinds:
        check = check_readings(changed(walking, **{kind: nothing}))
        assert check.ok, str(check)


def test_real_walking_has_no_findings_and_its_exchanges_are_found(shared_data):
    from mocap_jax.io.convert import read_mapping, read_source, recording_of, worn_sensors

    folder = shared_data / "opensense_walking"
    source = read_source(folder / "IMUData")
    mapping = read_mapping(folder / "myIMUMappings.xml")
    recording = recording_of(source, worn_sensors(source, mapping))
    assert check_readings(recording).ok
    inertial = dict(recording.inertial)
    a, b = "tibia_l_imu", "tibia_r_imu"
    inertial[a], inertial[b] = inertial[b], inertial[a]
    check = check_readings(dataclasses.replace(recording, inertial=inertial))
    assert [set(g) for g in check.exchanged] == [{a, b}]


def test_real_full_body_has_no_findings(shared_data):
    from mocap_jax.io.convert import read_source, recording_of, worn_sensors

    source = read_source(shared_data / "qmt_full_body_16imu")
    check = check_readings(recording_of(source, worn_sensors(source, None)))
    assert check.ok, str(check)

"""Each fault of a recording is refused in one line that names it."""

from __future__ import annotations

from dataclasses import replace

import jax
import numpy as np
import pytest
from io_samples import SENSORS, random_recording

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.io import validate_recording
from mocap_jax.recording import RestHold


@pytest.fixture()
def recording(body):
    return random_recording(body, n=60)


def with_pelvis(recording, **changes):
    stream = replace(recording.inertial["pelvis"], **changes)
    return replace(recording, inertial={**recording.inertial, "pelvis": stream})


def with_ranges(recording, **changes):
    return replace(recording, ranges=replace(recording.ranges, **changes))


def spoiled(values, at, value):
    values = np.array(values)
    values[at] = value
    return values


def paused(recording, seconds):
    """Every stream stops after its first ten samples, and goes on later."""
    rows = np.arange(60)
    time = 0.01 * rows + np.where(rows < 10, 0.0, seconds - 0.01)
    streams = {name: replace(s, time=time) for name, s in recording.inertial.items()}
    return replace(recording, inertial=streams, magnetic={}, ranges=None, root=None)


def walking(recording, speed):
    """The root goes straight on for six seconds [m/s]."""
    time = np.arange(60) / 10
    position = np.outer(speed * time, [0.6, 0.8, 0.0])
    return replace(recording, root=replace(recording.root, time=time, position=position))


FAULTS = {
    "no body model": lambda r: replace(r, body_xml=None),
    "body.xml: .*not a valid MJCF": lambda r: replace(r, body_xml="<mujoco><b/></mujoco>"),
    "neither inertial nor range": lambda r: replace(r, inertial={}, ranges=None),
    "/inertial/pelvis: the stream is empty": lambda r: with_pelvis(
        r,
        time=np.zeros(0),
        accelerometer=np.zeros((0, 3)),
        gyroscope=np.zeros((0, 3)),
        orientation=np.zeros((0, 4)),
    ),
    "goes backwards at sample 30": lambda r: with_pelvis(
        r, time=spoiled(r.inertial["pelvis"].time, 30, 0.0)
    ),
    "time repeats at sample 7": lambda r: with_pelvis(
        r, time=spoiled(r.inertial["pelvis"].time, 7, r.inertial["pelvis"].time[6])
    ),
    "1 time stamps are not finite": lambda r: with_pelvis(
        r, time=spoiled(r.inertial["pelvis"].time, 3, np.nan)
    ),
    "probably g;": lambda r: with_pelvis(r, accelerometer=np.tile([0.0, 0.0, 1.0], (60, 1))),
    "check unit and gravity": lambda r: with_pelvis(
        r, accelerometer=np.tile([0.0, 0.0, 0.01], (60, 1))
    ),
    "probably deg/s": lambda r: with_pelvis(r, gyroscope=np.full((60, 3), 90.0)),
    "infinite": lambda r: with_pelvis(r, gyroscope=np.full((60, 3), np.inf)),
    "gyroscope has shape": lambda r: with_pelvis(r, gyroscope=np.zeros((59, 3))),
    "/inertial/pelvis: orientation 5 is not a unit quaternion": lambda r: with_pelvis(
        r, orientation=spoiled(r.inertial["pelvis"].orientation, 5, [1.0, 1.0, 0.0, 0.0])
    ),
    "/root: orientation 2 is not a unit": lambda r: replace(
        r, root=replace(r.root, orientation=spoiled(r.root.orientation, 2, 0.0))
    ),
    "/root: positions move at 1400 m/s in the median over seconds: probably mil": lambda r: walking(
        r, 1400.0
    ),
    "nothing was measured for 3000 s, from .* cut out one stretch": lambda r: paused(r, 3000.0),
    "spans 0.000 s, fewer than 4 frames": lambda r: replace(
        r,
        inertial={"pelvis": jax.tree.map(lambda x: x[:1], r.inertial["pelvis"])},
        magnetic={},
        ranges=None,
        root=None,
    ),
    "hold, 100.00 to 101.00 s, is outside the recording.* --to 1.90 est": lambda r: replace(
        r, setup=replace(r.setup, rest=RestHold(100.0, 101.0))
    ),
    "hold, -9.00 to -8.00 s, is outside the recording.* --from 0.00 est": lambda r: replace(
        r, setup=replace(r.setup, rest=RestHold(-9.0, -8.0))
    ),
    "/root: time goes backwards": lambda r: replace(r, root=replace(r.root, time=-r.root.time)),
    "expected tesla": lambda r: replace(
        r, magnetic={"pelvis": replace(r.magnetic["pelvis"], field=np.full((20, 3), 30.0))}
    ),
    "sensor 'pelvs': unknown site 'pelvs'; valid: pelvis": lambda r: replace(
        r, inertial={"pelvs": r.inertial["pelvis"]}
    ),
    "range source 'source/bely': unknown site.*valid: source/belly": lambda r: with_ranges(
        r, source_names=("source/bely", "anchor/door")
    ),
    "range receiver 'hand': unknown site": lambda r: with_ranges(
        r, receiver_names=("hand", *SENSORS[1:])
    ),
    "source indices": lambda r: with_ranges(r, source=spoiled(r.ranges.source, 3, 9)),
    "receiver indices": lambda r: with_ranges(r, receiver=spoiled(r.ranges.receiver, 3, -1)),
    "negative distances": lambda r: with_ranges(r, distance=spoiled(r.ranges.distance, 3, -0.1)),
    "probably millimetres": lambda r: with_ranges(r, distance=r.ranges.distance * 1000),
    "expected 0 to 1": lambda r: with_ranges(r, confidence=spoiled(r.ranges.confidence, 3, 1.5)),
    "confidences from nan": lambda r: with_ranges(
        r, confidence=spoiled(r.ranges.confidence, 3, np.nan)
    ),
    "/range: time goes backwards": lambda r: with_ranges(r, time=r.ranges.time[::-1]),
    "rest pose: unknown joint 'RightKne'; valid: RightKnee": lambda r: replace(
        r, setup=replace(r.setup, rest=RestHold(0, 1, {"RightKne": (0.0,)}))
    ),
    "rest pose of ball joint 'RightHip' has 3": lambda r: replace(
        r, setup=replace(r.setup, rest=RestHold(0, 1, {"RightHip": (0.0, 0.0, 0.0)}))
    ),
}


@pytest.mark.parametrize("expected", FAULTS)
def test_fault_is_named(recording, expected) -> None:
    with pytest.raises(InputError, match=rf"^walk\.mcap: .*{expected}") as caught:
        validate_recording(FAULTS[expected](recording), name="walk.mcap")
    assert "\n" not in str(caught.value)


def test_sound_recording_passes_with_its_own_or_a_given_body(recording, body) -> None:
    validate_recording(recording)
    validate_recording(replace(recording, body_xml=None), body)
    validate_recording(replace(recording, ranges=None))
    validate_recording(replace(recording, inertial={}))


def test_simultaneous_ranges_are_sound(recording) -> None:
    validate_recording(with_ranges(recording, time=np.repeat(np.arange(40.0), 3)))


def test_accelerometers_of_a_weightless_body_may_read_zero(recording) -> None:
    xml = recording.body_xml.replace("<mujoco>", '<mujoco><option gravity="0 0 0"/>')
    free = with_pelvis(recording, accelerometer=np.zeros((60, 3)))
    validate_recording(free, load_body(xml))


def test_missing_values_are_sound(recording) -> None:
    validate_recording(with_pelvis(recording, gyroscope=np.full((60, 3), np.nan)))
    validate_recording(with_pelvis(recording, accelerometer=np.full((60, 3), np.nan)))


def test_pauses_of_minutes_are_sound(recording) -> None:
    validate_recording(paused(recording, 180.0))


@pytest.mark.parametrize("speed", [1.4, 90.0, 300.0])
def test_roots_of_vehicles_are_sound(recording, speed) -> None:
    validate_recording(walking(recording, speed))


def test_a_hold_that_ends_within_a_frame_of_the_first_sample_is_sound(recording) -> None:
    streams = {n: replace(s, time=np.asarray(s.time) + 0.0005) for n, s in
               recording.inertial.items()}  # fmt: skip
    late = replace(recording, inertial=streams, magnetic={}, ranges=None, root=None)
    assert late.interval[0] > 0.003
    validate_recording(replace(late, setup=replace(late.setup, rest=RestHold(0.0, 0.0))))
    with pytest.raises(InputError, match="outside the recording"):
        validate_recording(replace(late, setup=replace(late.setup, rest=RestHold(-0.1, -0.1))))


@pytest.mark.parametrize(
    ("rest", "way"), [((0.6, 1.3), "--from 1.30"), ((0.51, 1.59), "--from 1.59")]
)
def test_a_rest_hold_in_a_gap_is_refused(recording, rest, way) -> None:
    def part(stream):  # 28 Hz, to 2.1 s
        slow = replace(stream, time=5 * np.asarray(stream.time))
        kept = (slow.time < 0.53) | (slow.time > 1.6)
        return jax.tree.map(lambda x: np.asarray(x)[kept], slow)

    boards = {name: part(stream) for name, stream in recording.inertial.items()}
    holed = replace(recording, inertial=boards, magnetic={}, ranges=None, root=None)
    for sound in (RestHold(0.0, 0.4), RestHold(0.3, 1.5), RestHold(0.6, 9.0)):
        validate_recording(replace(holed, setup=replace(recording.setup, rest=sound)))
    lost = replace(holed, setup=replace(recording.setup, rest=RestHold(*rest)))
    with pytest.raises(InputError, match=rf"hold, .* lies in a gap: .* {way} est"):
        validate_recording(lost)

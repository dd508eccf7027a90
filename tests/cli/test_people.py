"""`simulate --with`: several people in one recording, measured directly or on wires."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import mocap_jax.motion
from mocap_jax.body import load_body
from mocap_jax.io import read_recording
from mocap_jax.motion import Motion
from mocap_jax.trajectory import Trajectory

USAGE, FAILURE = 2, 1
WORN = """
[[boards]]
name = "pelvis"
segment = "Pelvis"
position = [0.1, 0.0, 0.0]
orientation = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0]

[[boards]]
name = "chest"
segment = "T8"
position = [0.1, 0.0, 0.15]
orientation = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0]

[[sources]]
name = "belly"
segment = "Pelvis"
position = [0.12, 0.0, 0.05]
orientation = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0]

[[anchors]]
name = "lamp"
position = [0.7, 0.0, 2.4]
orientation = [0.0, 1.0, 0.0, 0.0]
emits = true
frequency = 47000

[[anchors]]
name = "ear"
position = [0.7, 1.0, 1.2]
orientation = [0.7071067811865476, 0.7071067811865476, 0.0, 0.0]

[[anchors]]
name = "mat"
position = [-2.0, -2.0, 0.02]
"""
"""The mat tells where the floor is below these people without legs; it is too far to be heard."""
FIGURES = """
[calibration.accelerometer.chest]
zero = [0.5, 0.0, 0.0]
slope = [1.0, 1.0, 1.0]

[calibration.accelerometer."b/chest"]
zero = [0.75, 0.0, 0.0]
slope = [1.0, 1.0, 1.0]

[calibration.gyroscope.pelvis]
zero = [0.0, 0.1, 0.0]
slope = [1.0, 1.0, 1.0]

[calibration.source_offset]
belly = { offset = 0.04 }
lamp = { offset = 0.02 }
"""


@pytest.fixture
def worn(tmp_path):
    path = tmp_path / "worn.toml"
    path.write_text(WORN)
    return path


def said(outcome) -> list[str]:
    """What was warned of, but for the mat, which hears nobody."""
    return [line for line in outcome.error_lines if "anchor/mat" not in line]


def owner(name: str) -> str:
    return next((p for p in "ab" if f"{p}/" in name), "room")


def test_two_people_hear_each_other_and_the_room(run, nod, worn, tmp_path):
    """Directly and on wires; b faces a."""
    direct, raw, decoded = (tmp_path / f"{n}.mcap" for n in ("direct", "two.raw", "decoded"))
    both = ["simulate", nod, "--with", nod, "--place", "1.4,0,180", "--sensors", worn]
    made = run(*both, "-o", direct)
    assert made.code == 0, made.err
    assert "a: nod and b: nod" in made.out and "4 boards, 3 sources" in made.out
    made = run(*both, "--raw", "-o", raw)
    assert made.code == 0, made.err
    outcome = run("decode", raw, "-o", decoded)
    assert outcome.code == 0 and said(outcome) == [], outcome.err
    for path in (direct, decoded):
        recording = read_recording(path)
        assert tuple(recording.inertial) == ("a/pelvis", "a/chest", "b/pelvis", "b/chest")
        ranges = recording.ranges
        assert ranges.source_names == ("source/a/belly", "source/b/belly", "anchor/lamp")
        assert ranges.receiver_names[-2:] == ("anchor/ear", "anchor/mat")
        told = recording.setup.provenance["source_frequencies_hz"]
        assert told == "40000, 33000, 47000"
        trusted = np.asarray(ranges.confidence) > 0.5
        pairs = {
            (owner(ranges.source_names[s]), owner(ranges.receiver_names[r]))
            for s, r in zip(ranges.source[trusted], ranges.receiver[trusted], strict=True)
        }
        assert pairs >= {("a", "b"), ("b", "a"), ("room", "a"), ("room", "b")}
    one, other = (_medians(read_recording(p).ranges) for p in (direct, decoded))
    for pair in one.keys() & other.keys():
        assert other[pair] == pytest.approx(one[pair], abs=0.01), pair


def _medians(ranges) -> dict[tuple[int, int], float]:
    """Median trusted distance of each pair that is well heard [m]."""
    pairs = np.stack([np.asarray(ranges.source), np.asarray(ranges.receiver)], axis=1)
    trusted, distance = np.asarray(ranges.confidence) > 0.5, np.asarray(ranges.distance)
    out = {}
    for pair in {tuple(p) for p in pairs[trusted].tolist()}:
        own = trusted & (pairs == pair).all(axis=1)
        if own.sum() > 30:
            out[pair] = float(np.median(distance[own]))
    assert len(out) > 5
    return out


def test_what_was_simulated_is_reconstructed(run, nod, worn, tmp_path):
    recording, found = tmp_path / "two.mcap", tmp_path / "two.json"
    both = ["simulate", nod, "--with", nod, "--place", "1.4,0,180", "--sensors", worn]
    assert run(*both, "-o", recording).code == 0
    outcome = run("reconstruct", recording, "--method", "ekf", "--root", "free", "--json", found)
    assert outcome.code == 0, outcome.err
    errors = json.loads(found.read_text())["errors"]["orientation_error_mean_deg"]
    assert {"a/T8", "b/T8"} <= set(errors) and errors["mean"] < 3.0


def test_frequencies_and_bodies_are_those_asked_for(run, nod, worn, tmp_path):
    """Sources of one frequency take turns."""
    out = tmp_path / "two.mcap"
    both = ["simulate", nod, "--with", nod, "--place", "1.4,0", "--sensors", worn, "-o", out]
    assert run(*both, "--frequencies", "30000,30000").code == 0
    recording = read_recording(out)
    told = recording.setup.provenance["source_frequencies_hz"]
    assert told == "30000, 30000, 47000"
    ranges = recording.ranges
    slots = [
        set(np.rint(np.asarray(ranges.time)[np.asarray(ranges.source) == s] / 0.008).astype(int))
        for s in range(3)
    ]
    assert not slots[0] & slots[1] and slots[0] & slots[2]
    roots = np.asarray(load_body(recording.body_xml).qpos0)[[0, 1, 11, 12]]
    np.testing.assert_allclose(roots, [0.0, 0.0, 1.4, 0.0], atol=1e-6)


def test_everybody_performs_in_the_body_that_was_asked_for(
    run, tmp_path, monkeypatch, nodding_body
):
    """Told by what is asked of the built-in motion; its two segments cannot wear the suit."""
    asked: list = []

    def performed(name, body=None):
        asked.append(body)
        q = np.tile(np.asarray(nodding_body.qpos0), (30, 1))
        return Motion(name, nodding_body, Trajectory(np.arange(30) / 60, q))

    monkeypatch.setattr(mocap_jax.motion, "builtin_motion", performed)
    outcome = run(
        "simulate", "routine", "--height", "1.9", "--with", "routine", "--with", "routine",
        "--place", "1,0", "--place", "0,1", "--with-body", "human:height=1.6",
        "--with-body", "human:height=1.7", "--rest", "0.5", "-o", tmp_path / "three.mcap",
        "--sensors", "sip6_tnt15",
    )  # fmt: skip
    assert outcome.code == FAILURE and "forearm" in outcome.err
    heights = [np.asarray(body.qpos0)[2] for body in asked]
    assert heights[0] > heights[2] > heights[1]


def test_three_people_are_recorded(run, nod, worn, tmp_path):
    """One behind the other; the lamp has one of the three frequencies already."""
    out = tmp_path / "three.mcap"
    three = ["simulate", nod, "--with", nod, "--with", nod, "--place", "1.2,0,180", "--place",
             "0,1.2,-90", "--sensors", worn]  # fmt: skip
    made = run(*three, "-o", out)
    assert made.code == 0, made.err
    assert "6 boards, 4 sources" in made.out
    (line,) = said(made)
    assert "none of 40000, 33000, 47000 Hz is left for c" in line
    assert "a 40000, b 33000, c 40000, anchors 47000" in line and "--frequencies" in line
    recording = read_recording(out)
    assert tuple(recording.inertial) == tuple(
        f"{p}/{board}" for p in "abc" for board in ("pelvis", "chest")
    )
    assert recording.setup.provenance["source_frequencies_hz"] == "40000, 33000, 40000, 47000"
    ranges, roots = recording.ranges, np.asarray(load_body(recording.body_xml).qpos0)
    np.testing.assert_allclose(roots[[0, 1, 11, 12, 22, 23]], [0, 0, 1.2, 0, 0, 1.2], atol=1e-6)
    heard = {
        (ranges.source_names[s].split("/")[1], ranges.receiver_names[r].split("/")[0])
        for s, r in zip(ranges.source, ranges.receiver, strict=True)
    }
    assert {("a", "b"), ("b", "a"), ("c", "a")} <= heard
    told = run(*three, "-o", out, "--frequencies", "40000,33000,27000")
    assert told.code == 0 and said(told) == [], told.err


def test_everybodys_sensors_err_by_the_figures_of_the_suit(run, nod, worn, tmp_path):
    """Names of the file are those of devices; each person wears one of each."""
    worn.write_text(WORN + FIGURES)
    out, raw = tmp_path / "two.mcap", tmp_path / "two.raw.mcap"
    both = ["simulate", nod, "--with", nod, "--place", "1.4,0,180", "--sensors", worn]
    made = run(*both, "-o", out, "--profile", "ideal")
    assert made.code == 0 and said(made) == [], made.err
    found = read_recording(out).setup.calibration
    zeros = {name: figure.zero[0] for name, figure in found.accelerometer.items()}
    assert zeros == {"a/chest": 0.5, "b/chest": 0.75}, "b's own figure goes before"
    assert set(found.gyroscope) == {"a/pelvis", "b/pelvis"}
    offsets = {site: found.offset_of(site) for site in read_recording(out).setup.sources}
    assert offsets == {"source/a/belly": 0.04, "source/b/belly": 0.04, "anchor/lamp": 0.02}
    made = run(*both, "-o", raw, "--raw")
    assert made.code == 0 and said(made) == [], made.err
    assert "4 boards, 3 sources" in made.out, "wires of anchors are no boards"


def test_figures_of_nobody_are_told_with_the_names_of_boards(run, nod, worn, tmp_path):
    worn.write_text(WORN + "[calibration.gyroscope.hat]\nzero = [0.1, 0, 0]\nslope = [1, 1, 1]\n")
    both = ["simulate", nod, "--with", nod, "--place", "1.4,0,180", "--sensors", worn]
    made = run(*both, "-o", tmp_path / "two.raw.mcap", "--raw")
    assert made.code == 0
    (line,) = said(made)
    assert line.endswith(
        "calibrates sensor hat, which is not worn; there are: a/pelvis, a/chest, b/pelvis, b/chest"
    )


def test_a_ball_in_the_hand_is_no_person(run, monkeypatch, nodding_body, nod, tmp_path):
    """A second free joint of one person, at his root, is not taken for another's root."""
    xml = nodding_body.xml.replace(
        "</worldbody>", '<body name="ball" pos="0 0 1"><freejoint/><geom size=".1"/></body>'
        "</worldbody>",
    )  # fmt: skip
    body = load_body(xml)
    clip = mocap_jax.motion.builtin_motion("routine")
    q = np.concatenate([clip.trajectory.q, np.tile(body.qpos0[-7:], (60, 1))], axis=1)
    juggler = replace(clip, body=body, trajectory=Trajectory(clip.trajectory.time, q))
    monkeypatch.setattr(mocap_jax.motion, "builtin_motion", lambda *_: juggler)
    both = ["simulate", nod, "--with", nod, "-o", tmp_path / "two.mcap", "--place"]
    outcome = run(*both, "0.1,0")
    assert outcome.code == USAGE and "a and b stand in each other" in outcome.err
    outcome = run(*both, "1.5,0,180")
    assert "stand in each other" not in outcome.err, outcome.err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--place", "1,0"], "--place is for several people: name the others by --with"),
        (["--with-body", "human"], "--with-body is for several people"),
        (["--frequencies", "40000,33000"], "--frequencies is for several people"),
        (["--with", "routine", "--place", "1,0", "--place", "2,0"], "--place is given for 2 of 1"),
        (["--with", "routine", "--frequencies", "40000"], "--frequencies is given for 1 of 2"),
        (["--with-fps", "60"], "--with-fps is for several people"),
        (["--with", "routine", "--with-fps", "60"], "--with-fps is for motion files, 'routine'"),
        (["--with", "routine", "--with-skip", "1", "--with-skip", "2"],
         "--with-skip is given for 2 of 1"),
        (["--with", "routine", "--with-scale", "0"], "'0' is not a number from 0.0001 to 10"),
        (["--with", "routine", "--with-body", "nobody"], "--with-body nobody: neither a file nor"),
        (["--with", "routine", "--with-body", "human:height=tall"],
         "--with-body human:height=tall: 'height=tall' cannot be read"),
        (["--with", "routine", "--with-body", "human:height=9"],
         "--with-body human:height=9: height must be 0.5 to 2.5 m"),
        (["--with", "routine", "--place", "1"], "'1' is not X,Y or X,Y,DEGREES"),
        (["--with", "routine", "--place", "1,nan"], "'1,nan' is not X,Y or X,Y,DEGREES"),
        (["--with", "routine", "--frequencies", "40000,-1"], "not a list of numbers above zero"),
        (["--with", "routine"] * 3, "4 people; say the --frequencies of their sources"),
        (["--with", "routine"] * 8, "9 people; at most 8 have names"),
        (["--with", "routine"], "a and b stand in each other (roots 0.00 m apart at 0.00 s); move"),
        (["--with", "routine", "--place", "2,0", "--sensors", "{bare}", "--frequencies", "1,2"],
         "--frequencies: the suit of --sensors has no ultrasonic sources"),
    ],
)  # fmt: skip
def test_wrong_usage(refused, nod, tmp_path, options, words):
    bare = tmp_path / "bare.toml"
    bare.write_text('[[boards]]\nname = "x"\nsegment = "T8"\nposition = [0, 0, 0]\n')
    options = [o.format(bare=bare) for o in options]
    refused(["simulate", nod, "-o", tmp_path / "a.mcap", *options], USAGE, words)


def test_motions_that_do_not_go_together(refused, nod, tmp_path):
    out = tmp_path / "a.mcap"
    refused(["simulate", nod, "-o", out, "--with", "waltz"], FAILURE, "waltz: neither a file")


def test_the_lower_frame_rate_is_everybodys(run, nod, worn, tmp_path, monkeypatch):
    out = tmp_path / "two.mcap"
    own: Callable[..., Motion] = mocap_jax.motion.builtin_motion

    def performed(name, body=None):
        clip = own(name, body)
        if name != "walking":
            return clip
        slow = Trajectory(2 * np.asarray(clip.trajectory.time), clip.trajectory.q)
        return replace(clip, trajectory=slow)

    monkeypatch.setattr(mocap_jax.motion, "builtin_motion", performed)
    both = ["simulate", nod, "--with", "walking", "--place", "1.4,0,180", "--sensors", worn]
    made = run(*both, "-o", out)
    assert made.code == 0, made.err
    assert "a: nod has 60 frames a second; brought to 30, the lowest rate of all" in made.out
    assert "b: nod has" not in made.out
    path = read_recording(out).truth.trajectory
    time, q = np.asarray(path.time), np.asarray(path.q)
    start = time[-1] - 29 / 30  # the clip of a, which is the shorter, ends the recording
    moving = (time > start + 0.1) & (time < time[-1] - 0.1)
    expected = 0.05 * np.sin(4 * (time[moving] - start))
    np.testing.assert_allclose(q[moving, 0], expected, atol=0.002)


def test_each_file_is_read_as_is_said_of_it(run, nodding_body, nod, worn, tmp_path):
    """A clip of 60 frames a second: of 1 s as it stands, of 2 s at 30 frames a second."""
    clip = tmp_path / "clip.npz"
    q = np.tile(np.asarray(nodding_body.qpos0), (61, 1))
    np.savez(clip, time=np.arange(61) / 60, q=q, body_xml=nodding_body.xml)
    out = tmp_path / "two.mcap"
    both = ["simulate", clip, "--with", clip, "--place", "1.4,0,180", "--sensors", worn, "-o", out]
    made = run(*both, "--fps", "30", "--with-fps", "20")
    assert made.code == 0 and "a: clip has 30 frames a second; brought to 20" in made.out
    made = run(*both, "--with-fps", "30", "--with-skip", "20")
    assert made.code == 0 and "a: clip has 60 frames a second; brought to 30" in made.out
    made = run(*both, "--fps", "30", "--with-fps", "-")
    assert made.code == 0 and "b: clip has 60 frames a second; brought to 30" in made.out


def test_frequencies_that_no_wire_carries(refused, nod, worn, tmp_path):
    """The direct simulation takes them; the driver box's amplifier does not."""
    both = ["simulate", nod, "--with", nod, "--place", "2,0", "--sensors", worn]
    asked = [*both, "-o", tmp_path / "a.mcap", "--raw", "--frequencies", "40000,70000"]
    refused(asked, FAILURE, "source/b/belly: bursts of 70000 Hz", "25000 to 55000 Hz")


def test_decode_tells_of_frequencies_too_near_to_each_other(run, nod, worn, tmp_path):
    raw, out = tmp_path / "near.raw.mcap", tmp_path / "near.mcap"
    both = ["simulate", nod, "--with", nod, "--place", "2,0", "--sensors", worn]
    assert run(*both, "-o", raw, "--raw", "--frequencies", "40000,37000").code == 0
    outcome = run("decode", raw, "-o", out)
    assert outcome.code == 0 and "37000 and 40000 Hz are less than 5000 Hz apart" in outcome.err

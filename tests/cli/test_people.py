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
"""The mat tells where the floor is below these people without legs."""


@pytest.fixture
def worn(tmp_path):
    path = tmp_path / "worn.toml"
    path.write_text(WORN)
    return path


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
    assert outcome.code == 0 and outcome.err == "", outcome.err
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


def test_three_people_have_the_built_in_bodies_that_were_asked_for(
    run, tmp_path, monkeypatch, nodding_body
):
    """One body for each of the others."""
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
    assert outcome.code == FAILURE and "forearm" in outcome.err  # two segments cannot wear it
    heights = [np.asarray(body.qpos0)[2] for body in asked]
    assert heights[0] > heights[2] > heights[1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--place", "1,0"], "--place is for several people: name the others by --with"),
        (["--with-body", "human"], "--with-body is for several people"),
        (["--frequencies", "40000,33000"], "--frequencies is for several people"),
        (["--with", "routine", "--place", "1,0", "--place", "2,0"], "--place is given for 2 of 1"),
        (["--with", "routine", "--frequencies", "40000"], "--frequencies is given for 1 of 2"),
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


def test_motions_that_do_not_go_together(refused, run, nod, tmp_path, monkeypatch):
    out = tmp_path / "a.mcap"
    refused(["simulate", nod, "-o", out, "--with", "waltz"], FAILURE, "waltz: neither a file")
    own: Callable[..., Motion] = mocap_jax.motion.builtin_motion

    def other(name, body=None):
        clip = own(name, body)
        if name != "walking":
            return clip
        slow = Trajectory(2 * np.asarray(clip.trajectory.time), clip.trajectory.q)
        return replace(clip, trajectory=slow)

    monkeypatch.setattr(mocap_jax.motion, "builtin_motion", other)
    words = "--with: frame rates differ: a 60 Hz, b 30 Hz"
    refused(["simulate", nod, "-o", out, "--with", "walking"], USAGE, words)


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

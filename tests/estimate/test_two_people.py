"""Two people who hear each other, in one recording: simulated by C MuJoCo, both reconstructed."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from test_anchored_root import CEILING, FREE, root_error
from wanderers import wanderer, worn

import mocap_jax as mj
from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.initialise import RestOptions
from mocap_jax.measurement import gather
from mocap_jax.motion import Motion, human, together
from mocap_jax.recording import RangeStream, Recording
from mocap_jax.simulation import Anchor, mount, simulate, suits_together
from mocap_jax.simulation.raw import simulate_raw
from mocap_jax.trajectory import Trajectory

SECONDS = 8.0
B_ROOT = 12
"""Where the second person's root is in q: after a root, a ball joint and an elbow."""


@pytest.fixture(scope="module")
def pair() -> Motion:
    return together({"a": wanderer(SECONDS), "b": wanderer(SECONDS, start=(1.6, 0.3), seed=1)})


@pytest.fixture(scope="module")
def recording(pair: Motion) -> Recording:
    suit = suits_together({"a": worn(), "b": worn(33_000.0)}, CEILING)
    return simulate(pair, profile="paper", suit=suit, seed=1)


def owner(name: str) -> str:
    return next((p for p in "ab" if f"{p}/" in name), "ceiling")


def only(recording: Recording, heard: set[tuple[str, str]]) -> Recording:
    """The recording with ranges between some owners alone (source's, receiver's)."""
    ranges = recording.ranges
    source = [owner(n) for n in ranges.source_names]
    receiver = [owner(n) for n in ranges.receiver_names]
    pairs = zip(np.asarray(ranges.source), np.asarray(ranges.receiver), strict=True)
    kept = np.array([(source[s], receiver[r]) in heard for s, r in pairs])
    columns = {
        f.name: np.asarray(getattr(ranges, f.name))[kept]
        for f in fields(RangeStream)
        if not f.name.endswith("_names")
    }
    return replace(recording, ranges=replace(ranges, **columns))


def test_bodies_keep_their_places_under_prefixed_names(pair: Motion) -> None:
    names = pair.body.topology.body_names
    assert names[1:] == tuple(
        f"{p}/{n}" for p in "ab" for n in ("Pelvis", "RightUpperArm", "RightForeArm")
    )
    single = wanderer(SECONDS, start=(1.6, 0.3), seed=1)
    np.testing.assert_allclose(pair.trajectory.q[:, B_ROOT:], single.trajectory.q, atol=1e-12)
    np.testing.assert_allclose(pair.body.qpos0[B_ROOT : B_ROOT + 2], [1.6, 0.3], atol=0.5)
    turned = together({"a": single, "b": single}, {"b": (2.0, 1.0, np.pi / 2)})
    a, b = turned.trajectory.q[:, :B_ROOT], turned.trajectory.q[:, B_ROOT:]
    np.testing.assert_allclose(b[:, :2], np.stack([2 - a[:, 1], 1 + a[:, 0]], axis=1), atol=1e-12)
    np.testing.assert_array_equal(b[:, 7:], a[:, 7:])
    facing = [load_body(turned.body.xml).qpos0[k + 3 : k + 7] for k in (0, B_ROOT)]
    np.testing.assert_allclose(2 * np.arccos(facing[1] @ facing[0]), np.pi / 2, atol=1e-9)
    tall, small = (_still(human(height=h)) for h in (1.9, 1.6))
    two = together({"x": tall, "y": small}).body
    feet = [n for n in two.topology.body_names if n.endswith("LeftFoot")]
    assert feet == ["x/LeftFoot", "y/LeftFoot"] and two.nq == tall.body.nq + small.body.nq


def test_devices_of_bodies_are_named_like_those_of_suits() -> None:
    one = wanderer(1.0)
    suit = replace(worn(), anchors=(Anchor("door", (1.0, 0.0, 2.0)),))
    dressed = replace(one, body=mount(one.body, suit))
    sites = together({"a": dressed, "b": dressed}).body.topology.site_names
    bare, both = together({"a": one, "b": one}).body, suits_together({"a": suit, "b": suit})
    assert set(sites) == set(mount(bare, both).topology.site_names)
    assert {"anchor/a/door", "anchor/b/door", "a/trunk"} <= set(sites)
    # Anchors belong to the room: who is put elsewhere does not take them along.
    moved = together({"a": dressed, "b": dressed}, {"b": (2.0, 0.0, 1.0)}).body
    np.testing.assert_allclose(moved.site_pos[moved.site_index("anchor/b/door")], (1.0, 0.0, 2.0))


def _still(body: mj.Body) -> Motion:
    poses = np.tile(np.asarray(body.qpos0), (120, 1))
    return Motion("still", body, Trajectory(np.arange(120) / 120, poses))


def test_frequencies_sound_at_the_same_time_and_sources_of_one_take_turns(
    recording: Recording,
) -> None:
    ranges = recording.ranges
    pulses = np.unique(np.stack([ranges.time, np.asarray(ranges.source, float)]), axis=1).T
    kind = [ranges.source_names[int(s)].startswith("source/b") for s in pulses[:, 1]]
    for b in (True, False):
        slots = pulses[np.array(kind) == b, 0]
        assert len(np.unique(slots)) == len(slots)
    both = set(pulses[np.array(kind), 0]) & set(pulses[~np.array(kind), 0])
    assert len(both) > 0.5 * SECONDS / 0.008
    assert recording.setup.provenance["source_frequencies_hz"].startswith("40000, 40000, 33000")
    # Nothing is lost on the way into frames.
    data = gather(recording, load_body(recording.body_xml), kinds="D", rate_hz=140.0)
    inside = (ranges.time > data.time[0]) & (ranges.time <= data.time[-1])
    assert (data.range_weight > 0).sum() == (inside & (ranges.confidence > 0)).sum()


def test_distances_between_bodies_hold_the_second_one(recording: Recording) -> None:
    """The ceiling is heard by `a` alone; `b` is placed by what it hears of `a` and `a` of it."""
    own = {("a", "a"), ("b", "b"), ("ceiling", "a")}
    between = own | {("a", "b"), ("b", "a")}
    near, apart = (only(recording, heard) for heard in (between, own))
    held, drifting = (mj.ekf(r, options=FREE) for r in (near, apart))
    for solution in (held, drifting):
        assert root_error(solution, recording)[140:].max() < 0.02
    late = slice(-280, None)
    assert root_error(held, recording, B_ROOT)[140:].max() < 0.12
    assert root_error(drifting, recording, B_ROOT)[late].mean() > 0.3
    assert root_error(held, recording, B_ROOT)[late].mean() < 0.06


@pytest.mark.parametrize(
    "hearing", ["b", pytest.param("a", marks=pytest.mark.slow),
                pytest.param("ab", marks=pytest.mark.slow)],
)  # fmt: skip
def test_whoever_hears_the_ceiling_declared_places_are_guesses(
    recording: Recording, hearing: str
) -> None:
    """Both are declared a quarter of a metre away from where they stand, and are found.

    By way of the other person alone, seconds of ranges tell a root to 8 cm (its stated deviation).
    """
    short = mj.cut(recording, 0.0, 4.0)
    heard = {(p, q) for p in "ab" for q in "ab"} | {("ceiling", p) for p in hearing}
    rest = short.setup.rest
    pose = dict(rest.pose)
    for person, shift in (("a", (0.2, -0.1, 0.05)), ("b", (-0.15, 0.2, -0.05))):
        pose[f"{person}/root"] = tuple(np.array(pose[f"{person}/root"]) + [*shift, 0, 0, 0, 0])
    setup = replace(short.setup, rest=replace(rest, pose=pose))
    moved = replace(only(short, heard), setup=setup, root=None)
    options = replace(FREE, smooth=True, rest=RestOptions(root_position_sigma=0.3))
    filtered = mj.ekf(moved, options=options)
    best = mj.optimise(
        moved, initial=filtered,
        options=mj.OptimiseOptions(
            kinds="AGD", root="free", noise=mj.NoiseOptions(adapt=False),
            constants=mj.ConstantsOptions(adapt=False),
        ),
    )  # fmt: skip
    for person, first in (("a", 0), ("b", B_ROOT)):
        assert root_error(filtered, short, first)[280:].max() < 0.05
        assert root_error(best, short, first).max() < (0.02 if person in hearing else 0.1)
    assert sum("anchors tell where in the room it is" in text for text in best.remarks) == 2


def test_the_second_root_is_said_to_be_free_where_that_of_the_first_is_given(
    recording: Recording,
) -> None:
    inertial = mj.cut(recording, 0.0, 1.0)
    told = mj.ekf(inertial, options=mj.EkfOptions(kinds="AG", root="given")).remarks
    assert any("The measured root is that of a/Pelvis. Root of b/Pelvis free" in t for t in told)


def test_wrong_people(pair: Motion) -> None:
    one = wanderer(1.0)
    with pytest.raises(InputError, match="1 motions; at least two people"):
        together({"a": one})
    with pytest.raises(InputError, match="'a/b' cannot be a prefix"):
        together({"a/b": one, "c": one})
    with pytest.raises(InputError, match="unknown person 'c'; valid: a, b"):
        together({"a": one, "b": one}, {"c": (0.0, 0.0, 0.0)})
    short = replace(one, trajectory=Trajectory(one.trajectory.time[:1], one.trajectory.q[:1]))
    with pytest.raises(InputError, match="motion of 'b' has 1 frame; at least two"):
        together({"a": one, "b": short})
    slow = replace(one, trajectory=Trajectory(2 * one.trajectory.time, one.trajectory.q))
    with pytest.raises(InputError, match="frame rates differ: a 120 Hz, b 60 Hz"):
        together({"a": one, "b": slow})
    xml = one.body.xml.replace("</worldbody>", "</worldbody><asset/>")
    with pytest.raises(InputError, match="'b' has <asset>"):
        together({"a": one, "b": replace(one, body=load_body(xml))})
    xml = one.body.xml.replace(
        "</worldbody>", "</worldbody><custom><text name='t' data='x'/></custom>"
    )
    with pytest.raises(InputError, match="'b' has <custom> <text>; only <numeric>"):
        together({"a": one, "b": replace(one, body=load_body(xml))})
    with pytest.raises(InputError, match="source/b/left: bursts of 20000 Hz; the driver box"):
        simulate_raw(pair, suit=suits_together({"a": worn(), "b": worn(20_000.0)}))

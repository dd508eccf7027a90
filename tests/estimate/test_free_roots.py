"""Who hears whom decides which declared places are guesses, and which hold a root."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from wanderers import wanderer, worn

import mocap_jax as mj
from mocap_jax.body import Body, load_body
from mocap_jax.estimate.derivatives.parameters import _reference_information
from mocap_jax.estimate.free_roots import free_roots
from mocap_jax.estimate.sequence.levels import information, initial_levels
from mocap_jax.estimate.sequence.pose_information import references
from mocap_jax.initialise import rest_pose
from mocap_jax.initialise.rest_options import RestOptions
from mocap_jax.motion import together
from mocap_jax.recording import Recording, Setup
from mocap_jax.simulation import Anchor, mount, simulate, suits_together

REST = np.arange(4)
JOINTS = [6, 7, 8, 9, 16, 17, 18, 19, 26, 27, 28, 29]
"""Three people: after each root (six coordinates) a ball joint and an elbow."""


@pytest.fixture(scope="module")
def body() -> Body:
    one = wanderer(0.2)
    suit = suits_together({p: worn() for p in "abc"}, (Anchor("door", (1.0, 0.0, 2.0)),))
    return mount(together({p: one for p in "abc"}).body, suit)


def ranges(body: Body, *pairs: tuple[str, str], weight: float = 1.0) -> Any:
    """Six frames in each of which each pair (source, receiver) has two ranges."""
    at = body.topology.site_index
    k = 2 * max(len(pairs), 1)
    source, receiver, heard = np.zeros((6, k), int), np.zeros((6, k), int), np.zeros((6, k))
    for i, (a, b) in enumerate(2 * pairs):
        source[:, i], receiver[:, i], heard[:, i] = at(a), at(b), weight
    return SimpleNamespace(
        time=np.arange(6) / 10, step=0.1, range_source=source, range_receiver=receiver,
        range_weight=heard, root_position=np.ones((6, 3)),
        root_orientation=np.tile([1.0, 0.0, 0.0, 0.0], (6, 1)),
    )  # fmt: skip


DOOR = "anchor/door"


@pytest.mark.parametrize(
    ("pairs", "given", "expected"),
    [
        ((), False, ("none", "none", "none")),
        ((("source/a/left", "a/upper"),), False, ("none", "none", "none")),
        ((("source/a/left", DOOR),), False, ("anchors", "none", "none")),
        ((("source/b/left", DOOR),), False, ("none", "anchors", "none")),
        ((("source/a/left", DOOR), ("source/b/left", DOOR)), False, ("anchors", "anchors", "none")),
        # By way of others, whoever hears and whoever sounds.
        ((("source/c/left", DOOR), ("source/b/left", "c/upper"), ("source/b/left", "a/upper")),
         False, ("anchors", "anchors", "anchors")),
        ((("source/b/left", "a/upper"),), False, ("none", "person", "none")),
        ((("source/c/left", "b/upper"),), False, ("none", "none", "person")),
        ((), True, ("measured", "none", "none")),
        ((("source/b/left", "a/upper"),), True, ("measured", "person", "none")),
        ((("source/b/left", DOOR),), True, ("measured", "anchors", "none")),
    ],
)  # fmt: skip
def test_what_ties_whom(
    body: Body, pairs: tuple[tuple[str, str], ...], given: bool, expected: tuple[str, ...]
) -> None:
    found = free_roots(ranges(body, *pairs), body.topology, root_given=given)
    assert tuple(root.tie for root in found) == expected
    assert [root.name for root in found] == ["a/Pelvis", "b/Pelvis", "c/Pelvis"]
    assert [(root.first_q, root.first_v) for root in found] == [(0, 0), (12, 10), (24, 20)]
    people = {"person": found[expected.index("person") - 1].name} if "person" in expected else {}
    assert all(root.person == people.get(root.tie, "") for root in found)


@pytest.mark.parametrize(("weight", "tie"), [(0.0, "none"), (0.8, "none"), (0.9, "anchors")])
def test_ranges_tie_whose_confidences_add_up(body: Body, weight: float, tie: str) -> None:
    heard = ranges(body, ("source/a/left", DOOR), weight=weight)  # twelve of them
    assert free_roots(heard, body.topology, root_given=False)[0].tie == tie


def test_what_either_of_two_people_hears_adds_up(body: Body) -> None:
    there, back = ("source/b/left", "a/upper"), ("source/a/left", "b/upper")
    for pairs, tie in (((there,), "none"), ((back,), "none"), ((there, back), "person")):
        found = free_roots(ranges(body, *pairs, weight=0.5), body.topology, root_given=False)
        assert found[1].tie == tie


def test_a_stray_range_leaves_the_declared_place_held(body: Body) -> None:
    stray = ranges(body, ("source/a/left", DOOR))
    stray.range_weight[1:] = stray.range_weight[:, 1:] = 0.0
    np.testing.assert_allclose(held(body, stray)[:6], len(REST) / 0.005**2)


def held(body: Body, data: Any, *, given: bool = False) -> np.ndarray:
    """Information of the declared rest pose over all frames (nv,)."""
    roots = free_roots(data, body.topology, root_given=given)
    nobody = np.zeros(body.nv, bool)
    found = references(
        data, body, Setup(sensors=()), mj.OptimiseOptions(), REST, nobody, roots
    )[1]  # fmt: skip
    assert not found[1][:, body.topology.root_dofs].any()
    return found[0].sum(0)


def test_where_ranges_tell_the_declared_place_of_every_root_is_a_guess(body: Body) -> None:
    guess, hold = np.repeat([1.0, 1 / 0.3**2], 3), np.full(6, len(REST) / 0.005**2)
    first, second, third = slice(0, 6), slice(10, 16), slice(20, 26)
    alone = held(body, ranges(body, ("source/b/left", DOOR)))
    np.testing.assert_allclose(alone[first], hold)
    np.testing.assert_allclose(alone[second], guess)
    np.testing.assert_allclose(alone[third], hold)
    np.testing.assert_allclose(alone[JOINTS], 1 / mj.PriorOptions().rest_sigma ** 2)
    apart = held(body, ranges(body, ("source/b/left", "a/upper")))
    np.testing.assert_allclose(apart[first], hold)
    np.testing.assert_allclose(apart[second], guess)
    measured = held(body, ranges(body, ("source/b/left", "a/upper")), given=True)
    noise = Setup(sensors=()).noise
    np.testing.assert_allclose(measured[:3], 6 / noise.root_position**2)
    np.testing.assert_allclose(measured[second], guess)


def test_noise_levels_of_the_rest_pose_leave_roots_alone(body: Body) -> None:
    """The solver whitens anew in every round: joints as it found them, roots as they were."""
    before = np.ones((2, 6, body.nv))
    built = SimpleNamespace(
        rest_frames=REST, terms=SimpleNamespace(reference_information=before),
        layout=SimpleNamespace(topology=body.topology, use_range=False),
        variances={k: (np.full((6, 1), np.inf), np.zeros((6, 1)))
                   for k in ("accelerometer", "gyroscope", "orientation", "range")},
    )  # fmt: skip
    levels = initial_levels(mj.OptimiseOptions(), 1)
    found = information(built, None, levels, 1.0)["reference_information"][0]  # type: ignore[arg-type]
    np.testing.assert_array_equal(found[:, body.topology.root_dofs], 1.0)
    np.testing.assert_allclose(found[REST][:, JOINTS], 1 / (levels.rest**2 * len(REST)))


def test_the_rest_prior_of_a_differentiable_estimate_leaves_roots_alone(body: Body) -> None:
    def figures(rest_sigma: float) -> Any:
        return SimpleNamespace(figures=SimpleNamespace(
            root_position=jnp.array(0.01), root_orientation=jnp.array(0.01),
            rest_sigma=jnp.array(rest_sigma), pose_sigma=jnp.array(1.0),
        ))  # fmt: skip

    fixed = SimpleNamespace(
        base=figures(0.05), root_known=jnp.zeros(6, bool),
        terms=SimpleNamespace(reference_information=jnp.ones((2, 6, body.nv))),
    )  # fmt: skip
    layout = SimpleNamespace(topology=body.topology)
    found = _reference_information(layout, fixed, figures(0.1))[0]  # type: ignore[arg-type]
    np.testing.assert_allclose(found[:, JOINTS], 0.25)
    np.testing.assert_allclose(found[:, body.topology.root_dofs], 1.0)


@pytest.fixture(scope="module")
def recording() -> Recording:
    pair = together({p: wanderer(0.5) for p in "ab"})
    return simulate(pair, suit=suits_together({p: worn() for p in "ab"}), seed=0)


def test_a_filter_starts_as_uncertain_of_every_root(recording: Recording) -> None:
    body = load_body(recording.body_xml)
    for use_root in (True, False):
        rest = rest_pose(
            recording, body, options=RestOptions(root_position_sigma=0.5), use_root=use_root
        )
        sigma = np.sqrt(np.diag(rest.covariance))
        np.testing.assert_allclose(sigma[10:13], 0.5, rtol=1e-6)
        if use_root:
            assert sigma[:3].max() < 0.05
        else:
            np.testing.assert_allclose(sigma[:3], 0.5, rtol=1e-6)

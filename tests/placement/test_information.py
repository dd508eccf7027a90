"""Information of boards against the estimator's own normal equations."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax import so3
from mocap_jax.body import Body
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.estimate.sequence.terms import build
from mocap_jax.measurement import FrameData
from mocap_jax.placement import Judge, PlacementOptions
from mocap_jax.placement.posterior import constant_information
from mocap_jax.placement.prior import estimator_options, on_grid
from mocap_jax.placement.rows import Boards, energies, system_of, variances_of
from mocap_jax.placement.scene import Scene
from mocap_jax.recording import SensorSpec, Setup
from mocap_jax.simulation import Mounting, Suit, mount

PLACES = (("T8", (0.1, 0.02, 0.1)), ("RightForeArm", (0.03, -0.01, -0.1)))


@pytest.fixture(scope="module")
def scene(person: Body, motions: tuple, quick: PlacementOptions) -> Scene:
    options = dataclasses.replace(quick, habits="estimator")
    return Judge(person, motions, options).criterion.scenes[0]


@pytest.fixture(scope="module")
def boards(person: Body) -> Boards:
    index = [person.topology.body_index(n) for n, _ in PLACES]
    position = np.array([p for _, p in PLACES])
    return Boards(jnp.asarray(index), jnp.asarray(position), jnp.array([1.0, 0.6]))


def estimators_equations(scene: Scene, boards: Boards, options: PlacementOptions, turns: list):
    """What `SequenceProblem` assembles at the true motion, and its block-diagonal corner."""
    suit = Suit(tuple(Mounting(n, n, p, t) for (n, p), t in zip(PLACES, turns, strict=True)))
    body = mount(scene.body, suit)
    sites = tuple(body.site_index(n) for n, _ in PLACES)
    k, t, step = scene.kinematics, scene.frames, float(scene.kinematics.step)
    turn = jnp.asarray(so3.quat_to_matrix(jnp.asarray(turns)))
    one = np.concatenate([np.ones((2, 1)), np.asarray(boards.position)], axis=1)
    force = np.einsum("tnij,nj->tni", np.asarray(k.force)[:t, np.asarray(boards.body)], one)
    rate = np.asarray(k.rate)[:t, np.asarray(boards.body)]
    to_sensor = lambda x: np.einsum("nij,tni->tnj", np.asarray(turn), x)  # noqa: E731
    # The root does not matter here: the scene's priors hold its information.
    empty, index = np.zeros((t, 0)), np.zeros((t, 0), int)
    q = np.tile(np.asarray(body.qpos0), (t, 1))
    data = FrameData(
        step * np.arange(t), np.asarray(step), to_sensor(force), to_sensor(rate),
        np.full((t, 2, 4), np.nan), empty, empty, index, index, empty, q[:, :3], q[:, 3:7],
        tuple(n for n, _ in PLACES), sites, "AG",
    )  # fmt: skip
    setup = Setup(
        sensors=tuple(SensorSpec(n, n, 140.0) for n, _ in PLACES),
        noise=on_grid(options.errors, step),
    )
    chosen = dataclasses.replace(estimator_options(options), constants=options.errors.constants)
    built = build(data, body, setup, chosen, root_given=True)
    zero = np.zeros((t, 2))
    variances = [np.asarray(v)[:t] for v in variances_of(k, boards, options.errors)]
    information = [np.asarray(boards.weight) / v for v in variances]
    information[0][[0, -1]] = 0.0
    information[1][-1] = 0.0
    terms = dataclasses.replace(
        built.terms, force=to_sensor(force), rate=to_sensor(rate),
        force_information=information[0], rate_information=information[1],
        orientation_information=zero,
        reference_information=np.zeros_like(built.terms.reference_information),
        smoothness_information=np.zeros_like(built.terms.smoothness_information),
        limit_information=np.zeros(t),
    )  # fmt: skip
    layout = dataclasses.replace(built.layout, inertial_loss="none")
    problem = SequenceProblem(
        layout, body, terms, built.weights, np.tile(constant_information(options.errors), 2)
    )
    still = np.zeros((2, 3))
    state = State(scene.poses, Constants(still, still, np.tile(np.eye(3), (2, 1, 1)), still))
    equations = problem.linearise(state)
    border = np.stack([equations.border(i) for i in range(t)])
    return equations.lower, border, equations.corner


def test_equations_are_the_estimators(scene: Scene, boards: Boards, quick: PlacementOptions):
    own = system_of(scene.body.topology, scene.kinematics, boards, quick.errors)
    lower, border, corner = estimators_equations(scene, boards, quick, [(1.0, 0, 0, 0)] * 2)
    t = scene.frames
    scale = np.abs(lower).max()
    for o in range(3):
        np.testing.assert_allclose(
            np.asarray(own.lower)[: t - o, o], lower[: t - o, o], atol=1e-9 * scale
        )
    np.testing.assert_allclose(np.asarray(own.border)[:t], border, atol=1e-9 * np.abs(border).max())
    for i in range(2):
        cells = slice(12 * i, 12 * i + 12)
        expected = corner[cells, cells] - np.diag(constant_information(quick.errors))
        np.testing.assert_allclose(
            np.asarray(own.corner)[i], expected, atol=1e-9 * np.abs(expected).max()
        )


def test_turning_a_board_on_its_segment_changes_no_information(
    scene: Scene, boards: Boards, quick: PlacementOptions
):
    """After the constants are eliminated, the estimator knows as much of the poses."""
    rng = np.random.default_rng(0)
    quats = rng.normal(size=(2, 4))
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    turned = [tuple(map(float, q)) for q in quats]
    kept = []
    for turns in ([(1.0, 0, 0, 0)] * 2, turned):
        lower, border, corner = estimators_equations(scene, boards, quick, turns)
        flat = np.swapaxes(border, 1, 2).reshape(-1, border.shape[1])
        kept.append((lower.copy(), flat @ np.linalg.solve(corner, flat.T)))
    t = scene.frames
    for o in range(3):
        np.testing.assert_allclose(
            kept[0][0][: t - o, o], kept[1][0][: t - o, o], atol=1e-9 * np.abs(kept[0][0]).max()
        )
    np.testing.assert_allclose(kept[0][1], kept[1][1], atol=1e-7 * np.abs(kept[0][1]).max())


def test_energies_are_quadratic_forms_of_the_equations(
    scene: Scene, boards: Boards, quick: PlacementOptions
):
    rng = np.random.default_rng(1)
    total, t, nv = len(scene.kinematics.present), scene.frames, scene.body.nv
    x, z = np.zeros((total, nv, 1)), rng.normal(size=(2, 12, 1))
    x[:t] = rng.normal(size=(t, nv, 1))
    whole = boards._replace(weight=jnp.ones(2))
    own = system_of(scene.body.topology, scene.kinematics, whole, quick.errors)
    lower = np.asarray(own.lower)
    dense = np.zeros((total * nv, total * nv))
    for k in range(total):
        for o in range(min(3, total - k)):
            rows = slice((k + o) * nv, (k + o + 1) * nv)
            dense[rows, k * nv : (k + 1) * nv] = lower[k, o]
    dense = np.tril(dense) + np.tril(dense, -1).T
    flat, constants = x.ravel(), z.ravel()
    coupling = np.einsum("tmv,tvp->mp", np.asarray(own.border), x)[:, 0]
    corner = sum(z[i, :, 0] @ np.asarray(own.corner)[i] @ z[i, :, 0] for i in range(2))
    expected = flat @ dense @ flat + 2 * constants @ coupling + corner
    found = energies(
        scene.body.topology, scene.kinematics, boards, quick.errors, jnp.asarray(x), jnp.asarray(z)
    )
    np.testing.assert_allclose(float(found.sum()), expected, rtol=1e-9)

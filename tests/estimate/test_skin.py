"""Boards that move on the skin: what the optimiser returns is the body's own motion."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from synthetic import SENSORS, record, small_body

import mocap_jax as mj
from mocap_jax import so3
from mocap_jax.body import joint_dofs
from mocap_jax.estimate.sequence.adapt import _rest
from mocap_jax.estimate.sequence.levels import information, initial_levels
from mocap_jax.estimate.sequence.pose_information import _skin
from mocap_jax.estimate.sequence.terms import Built, build
from mocap_jax.estimate.skin import displaced, on_skin
from mocap_jax.measurement import gather
from mocap_jax.recording import Recording

SKIN = mj.PriorOptions(skin_sigma=0.005, skin_frequency=10.0)
# Errors of acceleration beside those of the skin would hide what is tested here.
NOISE = mj.NoiseOptions(model_errors=False, adapt=False)
RIGID = mj.ConstantsOptions(mounting_sigma=0.0, offset_sigma=0.0, adapt=False)


def shaken(size: float = 0.004) -> Recording:
    """A recording whose accelerometers ring at 12 Hz once the body moves."""
    recording = record(seconds=4.0, root=True)
    inertial, rng = {}, np.random.default_rng(5)
    for name, board in recording.inertial.items():
        t = np.asarray(board.time)
        envelope = np.clip((t - 1.2) / 0.3, 0, 1)[:, None]
        omega = 2 * np.pi * 12.0
        ring = -size * omega**2 * np.sin(omega * t[:, None] + rng.uniform(0, 6, 3)) * envelope
        inertial[name] = dataclasses.replace(board, accelerometer=board.accelerometer + ring)
    return dataclasses.replace(recording, inertial=inertial)


def worst_turn(solution: mj.Solution, recording: Recording) -> float:
    """RMS error of the shoulder's rotation [rad]."""
    body = small_body()
    at = body.topology.joint_qpos[body.topology.joint_index("shoulder")]
    true = np.asarray(recording.truth.trajectory.q)[:, at : at + 4]
    found = np.asarray(solution.trajectory.q)[:, at : at + 4]
    error = so3.quat_multiply(so3.quat_conjugate(jnp.asarray(true)), jnp.asarray(found))
    return float(np.sqrt((np.asarray(so3.quat_log(error)) ** 2).sum(-1).mean()))


@pytest.fixture(scope="module")
def recording() -> Recording:
    return shaken()


def solve(recording: Recording, prior: mj.PriorOptions) -> mj.Solution:
    few = dataclasses.replace(
        recording, inertial={k: recording.inertial[k] for k in ("pelvis", "forearm")}
    )
    options = mj.OptimiseOptions(
        kinds="AG", initial="orientation", prior=prior, noise=NOISE, constants=RIGID
    )
    return mj.optimise(few, options=options)


@pytest.fixture(scope="module")
def solution(recording) -> mj.Solution:
    return solve(recording, SKIN)


def test_the_solution_is_of_the_body_itself(recording, solution):
    body = small_body()
    assert solution.status.ok and solution.body.topology == body.topology
    assert solution.trajectory.q.shape[1] == body.nq
    assert solution.covariance.shape[1:] == (body.nv, body.nv)
    assert np.linalg.eigvalsh(np.asarray(solution.covariance)).min() > 0
    assert solution.observed == solve(recording, mj.PriorOptions()).observed


def test_ringing_boards_mislead_less(recording, solution):
    """With one board for two segments, accelerations tell the shoulder from the elbow."""
    stiff = solve(recording, mj.PriorOptions())
    assert worst_turn(solution, recording) < 0.6 * worst_turn(stiff, recording)


@pytest.fixture(scope="module")
def built(recording) -> Built:
    """The problem of boards that float."""
    body = on_skin(small_body(), recording)
    options = mj.OptimiseOptions(kinds="AG", prior=SKIN, noise=NOISE)
    return build(
        gather(recording, body, kinds="AG"), body, recording.setup, options, root_given=True
    )


def test_the_rest_pose_declares_nothing_of_the_skin(built):
    """At the options' figures, levels state the very priors that the problem was built with."""
    levels = initial_levels(mj.OptimiseOptions(prior=SKIN, noise=NOISE), len(SENSORS))
    found = information(built, None, levels, repeats=1.0)["reference_information"]
    np.testing.assert_allclose(found, built.terms.reference_information, rtol=1e-12)
    floating = built.layout.topology.nv - np.arange(9, 0, -1)
    assert not found[0][:, floating].any() and found[1][:, floating].all()


def test_still_boards_do_not_make_the_rest_pose_sure(recording, built):
    """All joints off by the same: that is the deviation, whether boards float or not."""
    topology, body = built.layout.topology, small_body()
    joints, off = joint_dofs(topology), 0.03
    assert len(joints) == body.nv - 6
    at = built.rest_frames[len(built.rest_frames) // 2]
    step = off * np.isin(np.arange(body.nv), joints)
    held = np.asarray(built.terms.reference)[0, at, : body.nq]
    turned = np.asarray(mj.retract(body.topology, jnp.asarray(held), jnp.asarray(step)))
    problem = SimpleNamespace(layout=built.layout)
    poses = displaced(np.tile(turned, (at + 1, 1)), on_skin(body, recording))
    levels = initial_levels(mj.OptimiseOptions(prior=SKIN), len(SENSORS))
    draws = [(np.zeros((len(built.terms.force), topology.nv)), np.zeros(0))]
    found = _rest(problem, SimpleNamespace(q=poses), draws, built, levels, 1.0)
    assert found == pytest.approx(off, rel=1e-6)


def test_the_prior_s_figures_give_the_stated_deviation():
    size, density = _skin(SKIN)
    omega = np.linspace(0, 4000, 400001)
    spectrum = 1 / (1 / size + omega**4 / density)
    variance = np.trapezoid(spectrum, omega) / np.pi
    assert np.sqrt(variance) == pytest.approx(SKIN.skin_sigma, rel=1e-3)
    assert set(SENSORS) == {"pelvis", "upper_arm", "forearm"}

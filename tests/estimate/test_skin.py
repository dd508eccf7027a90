"""Boards that move on the skin: what the optimiser returns is the body's own motion."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from synthetic import SENSORS, record, small_body

import mocap_jax as mj
from mocap_jax import so3
from mocap_jax.estimate.sequence.pose_information import _skin
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


def test_the_prior_s_figures_give_the_stated_deviation():
    size, density = _skin(SKIN)
    omega = np.linspace(0, 4000, 400001)
    spectrum = 1 / (1 / size + omega**4 / density)
    variance = np.trapezoid(spectrum, omega) / np.pi
    assert np.sqrt(variance) == pytest.approx(SKIN.skin_sigma, rel=1e-3)
    assert set(SENSORS) == {"pelvis", "upper_arm", "forearm"}

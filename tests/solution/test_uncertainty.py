"""Propagated uncertainty: derivatives, closed forms, draws, and what the root must not touch."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from small_person import moved, person, solution, swing

import mocap_jax as mj
from mocap_jax.body import Body, frames, load_body, retract
from mocap_jax.errors import InputError
from mocap_jax.solution import uncertainty
from mocap_jax.solution.angles import joint_angles
from mocap_jax.solution.pose_jacobians import pose_jacobians
from mocap_jax.solution.poses import root_segment, segment_poses
from mocap_jax.trajectory import Trajectory

# Two hinges about z, links along x, on the world.
CHAIN = """<mujoco><worldbody><body name="A"><joint name="a" axis="0 0 1"/><geom size=".1"/>
<body name="B" pos=".4 0 0"><joint name="b" axis="0 0 1"/><geom size=".1"/>
<body name="C" pos=".3 0 0"><geom size=".1"/></body></body></body></worldbody></mujoco>"""


def covariances(nv: int, frames: int, size: float = 1e-3, seed: int = 0) -> np.ndarray:
    """Random covariances of correlated degrees of freedom."""
    factor = size * np.random.default_rng(seed).normal(size=(frames, nv, nv)) / np.sqrt(nv)
    return factor @ np.swapaxes(factor, 1, 2)


def stated(body: Body, frames: int = 3, **changes: object) -> mj.Solution:
    return solution(
        body, swing(body, frames=frames), covariance=covariances(body.nv, frames), **changes
    )


def test_derivatives_are_those_of_the_kinematics() -> None:
    body = person()
    q = jnp.asarray(swing(body, frames=5).q[4])
    root = root_segment(body.topology)

    def placed(delta: jax.Array) -> tuple[jax.Array, ...]:
        f = frames(body, retract(body.topology, q, delta))
        R_root = f.rotation[root]
        return (
            f.rotation, f.position,
            jnp.swapaxes(R_root, 0, 1) @ f.rotation, (f.position - f.position[root]) @ R_root,
        )  # fmt: skip

    zero = jnp.zeros(body.nv)
    at, slope = placed(zero), jax.jacfwd(placed)(zero)
    found = pose_jacobians(body, q)
    vector = _rotation_vectors
    np.testing.assert_allclose(found.orientation, vector(slope[0], at[0]), atol=1e-12)
    np.testing.assert_allclose(found.position, slope[1], atol=1e-12)
    inside = found.orientation_in_root[1:], found.position_in_root[1:]  # the world is no segment
    np.testing.assert_allclose(inside[0], vector(slope[2], at[2])[1:], atol=1e-12)
    np.testing.assert_allclose(inside[1], slope[3][1:], atol=1e-12)


def _rotation_vectors(dR: jax.Array, R: jax.Array) -> jax.Array:
    """Of dR = skew(e) R, (nbody, 3, nv)."""
    skew = jnp.einsum("bijv,bkj->bikv", dR, R)
    return jnp.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)


def test_closed_form_of_a_chain_of_hinges() -> None:
    body = load_body(CHAIN)
    a, b = 0.3, 0.8
    P = np.array([[4e-4, 1e-4], [1e-4, 9e-4]])
    path = Trajectory(np.zeros(1), np.array([[a, b]]))
    table = uncertainty(solution(body, path, covariance=P[None]))
    np.testing.assert_allclose(table.joint_angle_std[0], [0.02, 0.03])
    # C is at 0.4 (cos a, sin a) + 0.3 (cos(a + b), sin(a + b)), turned by a + b.
    across = lambda angle: np.array([-np.sin(angle), np.cos(angle)])  # noqa: E731
    to_b, to_c = 0.4 * across(a), 0.3 * across(a + b)
    J = np.stack([to_b + to_c, to_c], axis=1)
    C = {"segment": "C"}
    found = table.segment_position_covariance.sel(C)[0]
    np.testing.assert_allclose(found[:2, :2], J @ P @ J.T, atol=1e-15)
    np.testing.assert_allclose(found[2], 0.0, atol=1e-15)
    turn = table.segment_orientation_covariance.sel(C)[0]
    np.testing.assert_allclose(turn, np.diag([0, 0, P.sum()]), atol=1e-15)
    # Relative to A only the second hinge counts: in A's frame C swings about B.
    J_root = 0.3 * across(b)
    inside = table.segment_position_in_root_covariance.sel(C)[0]
    np.testing.assert_allclose(inside[:2, :2], P[1, 1] * np.outer(J_root, J_root), atol=1e-15)


def test_draws_of_the_pose_spread_as_stated() -> None:
    body, draws = person(), 4000
    q = np.repeat(np.asarray(swing(body, frames=20).q[-1:]), draws, 0)
    P = covariances(body.nv, 1)
    table = uncertainty(solution(body, Trajectory(np.zeros(1), q[:1]), covariance=P))
    delta = np.random.default_rng(1).multivariate_normal(np.zeros(body.nv), P[0], draws)
    drawn = moved(body, q, delta)
    R, p = segment_poses(body, drawn)
    R0, p0 = segment_poses(body, q[:1])
    root = root_segment(body.topology)
    names = list(table.segment.values)

    def same(variable: str, errors: np.ndarray, b: int) -> None:
        expected = table[variable].sel(segment=names[b - 1])[0].values
        got = errors.T @ errors / draws
        np.testing.assert_allclose(got, expected, atol=0.1 * np.trace(expected))

    turned = lambda a, b: Rotation.from_matrix(a @ np.swapaxes(b, -1, -2)).as_rotvec()  # noqa: E731
    into = lambda a, b: np.swapaxes(a[:, root], 1, 2) @ b  # noqa: E731
    for b in (body.topology.body_index("RightHand"), body.topology.body_index("LeftFoot")):
        same("segment_orientation_covariance", turned(R[:, b], R0[:, b]), b)
        same("segment_position_covariance", p[:, b] - p0[:, b], b)
        inside = turned(into(R, R[:, b]), into(R0, R0[:, b]))
        same("segment_orientation_in_root_covariance", inside, b)
        seen = lambda R, p, b=b: (into(R, (p[:, b] - p[:, root])[..., None]))[..., 0]  # noqa: E731
        same("segment_position_in_root_covariance", seen(R, p) - seen(R0, p0), b)
    _, angles = joint_angles(body, Trajectory(np.zeros(draws), drawn))
    spread = np.std(np.unwrap(angles, axis=0), axis=0)
    np.testing.assert_allclose(spread, table.joint_angle_std[0], rtol=0.08)


def test_the_root_does_not_touch_what_is_relative_to_it() -> None:
    body = person()
    sure = stated(body)
    P = np.array(sure.covariance)
    P[:, :6] = P[:, :, :6] = 0.0
    lost = P.copy()
    lost[:, :6, :6] = 1e6 * np.eye(6)
    one, other = (uncertainty(dataclasses.replace(sure, covariance=x)) for x in (P, lost))
    for name in ("joint_angle_std", "segment_position_in_root_covariance",
                 "segment_orientation_in_root_covariance"):  # fmt: skip
        np.testing.assert_array_equal(one[name], other[name])
    assert (one.segment_position_in_root_std.sel(segment="Pelvis") == 0).all()
    assert (other.segment_position_std.sel(segment="Head") > 100).all()


def test_turning_the_world_turns_only_what_is_in_it() -> None:
    body = person()
    before = stated(body)
    turn = Rotation.from_rotvec([0.3, -0.5, 1.1])
    q = np.array(before.trajectory.q)
    q[:, :3] = turn.apply(q[:, :3])
    q[:, 3:7] = (turn * Rotation.from_quat(q[:, 3:7], scalar_first=True)).as_quat(scalar_first=True)
    M = np.eye(body.nv)
    M[:3, :3] = turn.as_matrix()  # root translation is in the world, its rotation in the body
    after = dataclasses.replace(
        before, trajectory=Trajectory(before.trajectory.time, q),
        covariance=M @ before.covariance @ M.T,
    )  # fmt: skip
    one, other = uncertainty(before), uncertainty(after)
    R = turn.as_matrix()
    for kind in ("position", "orientation"):
        name = f"segment_{kind}_covariance"
        np.testing.assert_allclose(other[name], R @ one[name].values @ R.T, atol=1e-15)
        name = f"segment_{kind}_in_root_covariance"
        np.testing.assert_allclose(other[name], one[name], atol=1e-15)
    np.testing.assert_allclose(other.joint_angle_std, one.joint_angle_std, rtol=1e-9)


@pytest.fixture(scope="module")
def paired() -> mj.Solution:
    """Neighbouring poses whose errors agree to a tenth."""
    body, t = person(), 4
    nv = body.nv
    joint = covariances(t * nv, 1, size=3e-4)[0]
    common = np.kron(np.ones((t, t)), covariances(nv, 1, size=2e-3, seed=1)[0])
    whole = (joint + common).reshape(t, nv, t, nv)
    P = np.stack([whole[k, :, k] for k in range(t)])
    C = np.stack([whole[k + 1, :, k] for k in range(t - 1)])
    path = swing(body, frames=t)
    out = solution(body, path, covariance=P, pair_covariance=C)
    return dataclasses.replace(out, options={"whole": whole.reshape(t * nv, t * nv)})


def test_velocities_spread_as_draws_of_neighbouring_poses(paired: mj.Solution) -> None:
    body, draws = paired.body, 4000
    t, nv, time = 4, body.nv, np.asarray(paired.trajectory.time)
    step = time[1] - time[0]
    whole = paired.options["whole"]
    delta = np.random.default_rng(2).multivariate_normal(np.zeros(t * nv), whole, draws)
    delta = delta.reshape(draws, t, nv)
    centre = np.repeat(np.asarray(paired.trajectory.q)[:, None], draws, 1)
    q = np.stack([moved(body, centre[k], delta[:, k]) for k in range(t)])
    angles = np.stack([joint_angles(body, Trajectory(time, q[:, i]))[1] for i in range(400)])
    table = uncertainty(paired)
    assert table.sizes["interval"] == t - 1
    assert float(table.interval[0]) == pytest.approx(step / 2)
    rates = np.diff(angles, axis=1) / step
    np.testing.assert_allclose(rates.std(axis=0), table.joint_angle_rate_std, rtol=0.2)
    np.testing.assert_allclose(rates.mean(axis=0), table.joint_angle_rate, atol=0.1)
    change = jax.vmap(jax.vmap(lambda a, b: mj.difference(body.topology, a, b)))
    steps = np.asarray(change(jnp.asarray(q[:-1]), jnp.asarray(q[1:]))) / step
    np.testing.assert_allclose(steps.std(axis=1), table.velocity_std, rtol=0.1)


def test_common_errors_do_not_blur_velocities(paired: mj.Solution) -> None:
    """Errors that stay add nothing to a difference: without the pairs they would."""
    apart = dataclasses.replace(paired, pair_covariance=np.zeros_like(paired.pair_covariance))
    one, other = uncertainty(paired), uncertainty(apart)
    assert (one.joint_angle_rate_std < 0.5 * other.joint_angle_rate_std).mean() > 0.9


def test_tables_hold_it_with_units() -> None:
    body = person()
    table = stated(body).to_xarray()
    assert table.joint_angle_std.attrs["units"] == "rad"
    assert table.segment_position_in_root_std.attrs == {
        "units": "m", "frame": "Pelvis",
        "description": "position of the segment's origin (its joint centre) in the Pelvis frame",
    }  # fmt: skip
    assert table.joint_angle_std.shape == table.joint_angle.shape
    assert "xyz_other" not in table.dims
    assert table.attrs["method"] == "optimise"
    bare = dataclasses.replace(stated(body), covariance=None)
    assert "joint_angle_std" not in bare.to_xarray()


def test_needs_a_covariance() -> None:
    with pytest.raises(InputError, match="no covariance; estimate it with covariance=True"):
        mj.uncertainty(dataclasses.replace(stated(person()), covariance=None))

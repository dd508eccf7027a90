"""Forward kinematics, level by level, with the exact geometric tangent rule.

`frames` returns the world frame of every body and the world screw of every degree of freedom.
Its derivative with respect to the pose is not traced through the tree: the tangent of a rigid
frame is its twist, the sum of the screws that move it. The rule is written with the outputs of
`frames` itself, so it can be differentiated again to any order.

A screw (angular, linear) gives the velocity of a point p fixed to the body as
`linear + angular x p`; both parts are in the world frame about the world origin.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body.model import Body
from mocap_jax.body.tangent import velocity_to_tangent
from mocap_jax.body.topology import BALL, FREE, HINGE, SLIDE, Topology


class Frames(NamedTuple):
    """World frames of all bodies and world screws of all degrees of freedom."""

    rotation: Float[Array, "nbody 3 3"]
    position: Float[Array, "nbody 3"]
    angular: Float[Array, "nv 3"]
    linear: Float[Array, "nv 3"]


class SiteFrames(NamedTuple):
    """World frames of sites: `rotation` maps site to world coordinates."""

    rotation: Float[Array, "nsite 3 3"]
    position: Float[Array, "nsite 3"]


class SiteMotion(NamedTuple):
    """World frames, velocities and accelerations of sites, all in world coordinates."""

    rotation: Float[Array, "nsite 3 3"]
    position: Float[Array, "nsite 3"]
    angular_velocity: Float[Array, "nsite 3"]
    velocity: Float[Array, "nsite 3"]
    angular_acceleration: Float[Array, "nsite 3"]
    acceleration: Float[Array, "nsite 3"]


_Parameters = tuple[Array, Array, Array, Array, Array]


def frames(body: Body, q: Float[Array, "nq"]) -> Frames:
    """World frames of all bodies and screws of all degrees of freedom at pose q."""
    parameters = (body.body_pos, body.body_quat, body.joint_pos, body.joint_axis, body.qpos0)
    return _frames(body.topology, parameters, q)


def plain_frames(topology: Topology, parameters: _Parameters, q: Float[Array, "nq"]) -> Frames:
    """The same as `frames` without the tangent rule (JAX differentiates through the tree)."""
    body_pos, body_quat, joint_pos, joint_axis, qpos0 = parameters
    rotating = np.isin(topology.joint_types, (HINGE, BALL))
    anchor = jnp.where(rotating[:, None], joint_pos, 0.0)
    joint_R, joint_t = _joint_motions(topology, anchor, joint_axis, q, q - qpos0)
    local_R, local_t, after_R, after_t = _local_frames(
        topology, body_pos, body_quat, joint_R, joint_t
    )
    R, p = _compose_levels(topology, local_R, local_t)
    parent = np.array(topology.body_parent)[np.array(topology.joint_body)]
    centre = after_t + so3.matvec3(after_R, anchor)
    angular, linear = _screws(
        topology,
        joint_axis,
        so3.matmul3(R[parent], after_R),
        p[parent] + so3.matvec3(R[parent], centre),
    )
    return Frames(R, p, angular, linear)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _frames(topology: Topology, parameters: _Parameters, q: Array) -> Frames:
    return plain_frames(topology, parameters, q)


def _frames_jvp(
    topology: Topology, primals: tuple[_Parameters, Array], tangents: tuple[_Parameters, Array]
) -> tuple[Frames, Frames]:
    parameters, q = primals
    parameters_dot, q_dot = tangents
    out = _frames(topology, parameters, q)
    zero = jax.custom_derivatives.SymbolicZero
    if isinstance(q_dot, zero):
        tangent = jax.tree.map(jnp.zeros_like, out)
    else:
        tangent = _pose_tangent(topology, out, velocity_to_tangent(topology, q, q_dot))
    if not all(isinstance(d, zero) for d in parameters_dot):
        dense = tuple(
            jnp.zeros_like(p) if isinstance(d, zero) else d
            for p, d in zip(parameters, parameters_dot, strict=True)
        )
        _, extra = jax.jvp(lambda x: plain_frames(topology, x, q), (parameters,), (dense,))
        tangent = jax.tree.map(jnp.add, tangent, extra)
    return out, tangent


_frames.defjvp(_frames_jvp, symbolic_zeros=True)


def _pose_tangent(topology: Topology, out: Frames, v: Array) -> Frames:
    """Directional derivative of `Frames` along the tangent vector v."""
    w_body, v_body = _twists(topology.body_dofs, out, v)
    w_axis, v_axis = _twists(topology.axis_dofs, out, v)
    return Frames(
        so3.matmul3(so3.skew(w_body), out.rotation),
        v_body + so3.cross(w_body, out.position),
        so3.cross(w_axis, out.angular),
        so3.cross(w_axis, out.linear) + so3.cross(v_axis, out.angular),
    )


def _twists(mask: np.ndarray, out: Frames, v: Array) -> tuple[Array, Array]:
    """Sum of the screws times v that each row of the mask selects."""
    weight = jnp.asarray(mask, v.dtype)
    return weight @ (out.angular * v[:, None]), weight @ (out.linear * v[:, None])


def _joint_motions(
    topology: Topology, anchor: Array, joint_axis: Array, q: Array, shift: Array
) -> tuple[Array, Array]:
    """Rotation and translation that each joint applies in its body's frame."""
    kinds = np.array(topology.joint_types)
    at = topology.joint_qpos
    hinge, slide = np.flatnonzero(kinds == HINGE), np.flatnonzero(kinds == SLIDE)
    free = np.flatnonzero(kinds == FREE)
    quaternion = np.flatnonzero((kinds == BALL) | (kinds == FREE))
    quat = q[topology.quat_index[0]]
    R = _rows_of_joints(
        jnp.eye(3, dtype=q.dtype),
        [
            (hinge, so3.exp(joint_axis[hinge] * shift[at[hinge], None])),
            (quaternion, so3.quat_to_matrix(so3.quat_normalise(quat))),
        ],
        topology.njoint,
    )
    slid = _rows_of_joints(
        jnp.zeros(3, q.dtype),
        [
            (slide, joint_axis[slide] * shift[at[slide], None]),
            (free, q[at[free][:, None] + np.arange(3)]),
        ],
        topology.njoint,
    )
    return R, slid + anchor - so3.matvec3(R, anchor)


def _rows_of_joints(rest: Array, groups: list[tuple[np.ndarray, Array]], njoint: int) -> Array:
    """One row per joint: that of its group, `rest` for joints of none (one gather, no scatter)."""
    source = np.zeros(njoint, int)
    start = 1
    for joints, _ in groups:
        source[joints] = start + np.arange(joints.size)
        start += joints.size
    return jnp.concatenate([rest[None], *(rows for _, rows in groups)])[source]


def _slots(topology: Topology) -> np.ndarray:
    """Joint in each slot of each body, shape (nbody, most joints of a body); -1 where none."""
    per_body = [topology.joints_of_body(b) for b in range(topology.nbody)]
    width = max(len(joints) for joints in per_body)
    return np.array([joints + [-1] * (width - len(joints)) for joints in per_body])


def _local_frames(
    topology: Topology, body_pos: Array, body_quat: Array, joint_R: Array, joint_t: Array
) -> tuple[Array, Array, Array, Array]:
    """Frame of each body in its parent, and of each joint (after its motion) in that parent."""
    free_bodies = [b for b, t in zip(topology.joint_body, topology.joint_types, strict=True)
                   if t == FREE]  # fmt: skip
    fixed = np.ones(topology.nbody, bool)
    fixed[free_bodies] = False
    R = so3.quat_to_matrix(so3.quat_normalise(body_quat))
    R = jnp.where(fixed[:, None, None], R, jnp.eye(3, dtype=R.dtype))
    t = jnp.where(fixed[:, None], body_pos, 0.0)
    R_slots, t_slots = [R], [t]
    # Rows of the slots laid end to end: where each body stands by now, and each joint.
    body_row, joint_row = np.arange(topology.nbody), np.zeros(topology.njoint, int)
    begin, rows = 0, topology.nbody
    for slot in _slots(topology).T:
        bodies = np.flatnonzero(slot >= 0)
        joints = slot[bodies]
        R_now, t_now = (x[-1][body_row[bodies] - begin] for x in (R_slots, t_slots))
        R_slots.append(so3.matmul3(R_now, joint_R[joints]))
        t_slots.append(t_now + so3.matvec3(R_now, joint_t[joints]))
        begin, rows = rows, rows + bodies.size
        body_row[bodies] = joint_row[joints] = np.arange(begin, rows)
    R, t = jnp.concatenate(R_slots), jnp.concatenate(t_slots)
    return R[body_row], t[body_row], R[joint_row], t[joint_row]


def _compose_levels(topology: Topology, local_R: Array, local_t: Array) -> tuple[Array, Array]:
    """World frames from local ones, one batched product per tree level."""
    R_levels, p_levels = [local_R[:1]], [local_t[:1]]
    place = np.zeros(topology.nbody, int)
    for level in topology.levels[1:]:
        parent = place[np.array(topology.body_parent)[level]]
        R_parent, p_parent = R_levels[-1][parent], p_levels[-1][parent]
        R_levels.append(so3.matmul3(R_parent, local_R[level]))
        p_levels.append(p_parent + so3.matvec3(R_parent, local_t[level]))
        place[level] = np.arange(level.size)
    order = np.argsort(np.concatenate(topology.levels), kind="stable")
    return jnp.concatenate(R_levels)[order], jnp.concatenate(p_levels)[order]


def _screws(
    topology: Topology, joint_axis: Array, R_world_joint: Array, centre: Array
) -> tuple[Array, Array]:
    """World screws of all degrees of freedom.

    `R_world_joint` and `centre` are each joint's frame and fixed point after its own motion, which
    leaves the axis of a hinge or slide as it was.
    """
    joint = topology.dof_joint
    kind = np.array(topology.joint_types)[joint]
    place = np.arange(topology.nv) - topology.joint_dof[joint]
    single = np.isin(kind, (HINGE, SLIDE))[:, None]
    eye = jnp.eye(3, dtype=joint_axis.dtype)
    travels = ((kind == FREE) & (place < 3))[:, None]
    axis = jnp.where(single, joint_axis[joint], eye[place % 3])
    axis = jnp.where(travels, axis, so3.matvec3(R_world_joint[joint], axis))
    turns = ~(travels | (kind == SLIDE)[:, None])
    moment = so3.cross(centre[joint], axis)
    return jnp.where(turns, axis, 0.0), jnp.where(turns, moment, axis)


def site_frames(body: Body, q: Float[Array, "nq"]) -> SiteFrames:
    """World frames of all sites at pose q."""
    return sites_on_frames(body, frames(body, q))


def sites_on_frames(body: Body, f: Frames) -> SiteFrames:
    """World frames of all sites, given the world frames of the bodies."""
    on = np.array(body.topology.site_body, int)
    R_body_site = so3.quat_to_matrix(so3.quat_normalise(body.site_quat))
    return SiteFrames(
        so3.matmul3(f.rotation[on], R_body_site),
        f.position[on] + so3.matvec3(f.rotation[on], body.site_pos),
    )


def site_jacobians(
    body: Body, f: Frames, position: Float[Array, "nsite 3"], sites: np.ndarray
) -> tuple[Float[Array, "k nv 3"], Float[Array, "k nv 3"]]:
    """Geometric Jacobians, transposed: world velocity and angular velocity of sites per unit v.

    Args:
        body: the body.
        f: its frames at the pose.
        position: world positions of all sites (`sites_on_frames`).
        sites: indices of the sites wanted, static.

    Returns:
        (linear, angular), each of shape (len(sites), nv, 3).
    """
    mask = jnp.asarray(
        body.topology.body_dofs[np.array(body.topology.site_body)[sites]], f.angular.dtype
    )[:, :, None]
    angular = mask * f.angular
    linear = mask * f.linear + so3.cross(angular, position[sites][:, None, :])
    return linear, angular


def site_motion(
    body: Body, q: Float[Array, "nq"], v: Float[Array, "nv"], a: Float[Array, "nv"]
) -> SiteMotion:
    """World frames, velocities and accelerations of all sites (gravity not included).

    Args:
        body: the body.
        q: pose.
        v: velocity in the tangent space [rad/s, m/s].
        a: its time derivative, component by component, as in MuJoCo's `qacc`.
    """
    f = frames(body, q)
    on = np.array(body.topology.site_body, int)
    rotation, position = sites_on_frames(body, f)
    w_body, v_body = _twists(body.topology.body_dofs, f, v)
    screw_dot = _pose_tangent(body.topology, f, v)
    weight = jnp.asarray(body.topology.body_dofs, v.dtype)
    alpha = weight @ (f.angular * a[:, None] + screw_dot.angular * v[:, None])
    linear_dot = weight @ (f.linear * a[:, None] + screw_dot.linear * v[:, None])
    w = w_body[on]
    velocity = v_body[on] + so3.cross(w, position)
    acceleration = linear_dot[on] + so3.cross(alpha[on], position) + so3.cross(w, velocity)
    return SiteMotion(rotation, position, w, velocity, alpha[on], acceleration)

"""`retarget`: a motion fitted to another body.

Every frame's target is an orientation for each corresponding segment (`segment_match`) and a joint
centre: the target body's own offsets laid along those orientations, from a root path scaled by leg
length. Levenberg-Marquardt finds the pose, each frame from its predecessor's, so that the result
is continuous even where a body's joints allow several solutions.
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
from mocap_jax.body import Body, difference, frames, normalise, retract
from mocap_jax.body.topology import BALL, HINGE
from mocap_jax.errors import InputError
from mocap_jax.motion.motion import Motion
from mocap_jax.motion.pose_arrays import continuous_quaternions, segment_frames
from mocap_jax.motion.segment_match import SegmentMatch, match_segments
from mocap_jax.trajectory import Trajectory

# Weights of the residuals' parts: 0.1 rad of orientation counts as much as 2 cm of position;
# rest and limits are weak enough to cost a fraction of a degree where segments say otherwise.
_PER_RADIAN = 1.0
# About their long axes, the arm's segments follow what elbow and hand allow: hinges of two
# skeletons do not agree, and the difference should not go into where the bones point.
_PER_RADIAN_OF_TWIST = 0.3
_PER_METRE = 5.0
_PER_RADIAN_FROM_REST = 0.02
_PER_RADIAN_BEYOND_LIMIT = 2.0
_ARM = {"ForeArm": "UpperArm", "Hand": "ForeArm"}
"""Segments of the arm, by the one that follows."""
_LEAD_IN, _ITERATIONS = 12, 6


class _Targets(NamedTuple):
    """World orientation and joint centre of each corresponding segment."""

    rotation: Float[Array, "*t n 3 3"]
    position: Float[Array, "*t n 3"]
    weight: Float[Array, "*t n 3 3"]
    """On the turn from the target to the segment, in the segment's frame."""


def retarget(motion: Motion, body: Body) -> Motion:
    """Fit a motion to another body, by segment names.

    Args:
        motion: the clip; its body needs segments with Xsens, CMU, BVH or dm_control names.
        body: who shall perform it; with a free root.

    Returns:
        The motion of `body` at the same times. Its facts hold `orientation_error_mean_deg`,
        `orientation_error_max_deg`, `position_error_mean_cm`, `position_error_max_cm` (over all
        corresponding segments and frames, against the targets), `segments` and `scale`;
        `retarget_errors` tells them segment by segment.

    Raises:
        InputError: the body has no free root, or too few segments correspond.
    """
    if not body.has_free_root:
        raise InputError("retargeting needs a body with a free root (load_body(free_root=True))")
    match = match_segments(motion.body, body)
    targets = _targets(motion, match)
    q, orientation, position = _fit_clip(body, jnp.asarray(match.target_body), targets)
    q = jnp.asarray(continuous_quaternions(body.topology, np.asarray(q)))
    facts = dict(motion.facts) | {
        "retargeted_from": motion.name, "segments": ", ".join(match.names), "scale": match.scale,
        "orientation_error_mean_deg": float(jnp.degrees(orientation).mean()),
        "orientation_error_max_deg": float(jnp.degrees(orientation).max()),
        "position_error_mean_cm": float(100 * position.mean()),
        "position_error_max_cm": float(100 * position.max()),
    }  # fmt: skip
    return Motion(motion.name, body, Trajectory(motion.trajectory.time, q), facts)


def _targets(motion: Motion, match: SegmentMatch) -> _Targets:
    """What each segment of the target body should do, in all frames."""
    R_source, p_source = segment_frames(
        motion.body, np.asarray(motion.trajectory.q), match.source_body
    )
    R = R_source @ match.R_source_target
    position = np.empty_like(p_source)
    position[:, 0] = match.scale * p_source[:, 0]
    for i in range(1, len(match.names)):
        p = match.parent[i]
        position[:, i] = position[:, p] + R[:, p] @ match.offset[i]
    feet = [i for i, name in enumerate(match.names) if name in ("LeftFoot", "RightFoot")]
    if feet:  # feet as high above the floor as the scaled source's are
        ankles = match.scale * p_source[:, feet, 2] + match.ankle_rise
        position[..., 2] += np.median(ankles.min(axis=1) - position[:, feet, 2].min(axis=1))
    weight = np.broadcast_to(_turn_weights(match), R.shape)
    return _Targets(jnp.asarray(R), jnp.asarray(position), jnp.asarray(weight))


def _turn_weights(match: SegmentMatch) -> Float[np.ndarray, "n 3 3"]:
    """Weights of the turn's components: less about the long axes of the arm."""
    weights = np.tile(_PER_RADIAN * np.eye(3), (len(match.names), 1, 1))
    for name, p, offset in zip(match.names, match.parent, match.offset, strict=True):
        part = name.removeprefix("Left").removeprefix("Right")
        if part in _ARM and match.names[p].endswith(_ARM[part]) and (offset @ offset) > 1e-6:
            along = np.outer(offset, offset) / (offset @ offset)
            weights[p] -= (_PER_RADIAN - _PER_RADIAN_OF_TWIST) * along
    return weights


@jax.jit
def _fit_clip(body: Body, chosen: Array, targets: _Targets) -> tuple[Array, Array, Array]:
    """Poses (t nq), orientation errors (t n) [rad] and position errors (t n) [m]."""
    first = jax.tree.map(lambda x: x[0], targets)
    root = jnp.concatenate([first.position[0], so3.quat_from_matrix(first.rotation[0])])
    # The first frame starts far away: it is met several times.
    again = jax.tree.map(lambda x: jnp.concatenate([jnp.repeat(x[:1], _LEAD_IN, 0), x]), targets)

    def step(q: Array, target: _Targets) -> tuple[Array, tuple[Array, Array, Array]]:
        fit = _fit_frame(body, chosen, q, target)
        weighted, shift = jnp.split(fit.residual[: 6 * len(target.position)].reshape(-1, 3), 2)
        turn = jnp.linalg.solve(target.weight, weighted[..., None])[..., 0]
        errors = jnp.linalg.norm(turn, axis=-1), jnp.linalg.norm(shift, axis=-1)
        return fit.q, (fit.q, errors[0], errors[1] / _PER_METRE)

    result = jax.lax.scan(step, body.qpos0.at[:7].set(root), again)[1]
    return jax.tree.map(lambda x: x[_LEAD_IN:], result)


class _Fit(NamedTuple):
    """The best pose so far with its residual and derivative, and the damping to go on with."""

    q: Array
    residual: Array
    jacobian: Array
    cost: Array
    damping: Array


def _fit_frame(body: Body, chosen: Array, q: Array, target: _Targets) -> _Fit:
    """Levenberg-Marquardt with a fixed number of iterations; steps that do not help are undone."""

    def iterate(_: int, best: _Fit) -> _Fit:
        H = best.jacobian.T @ best.jacobian + best.damping * jnp.eye(body.nv)
        delta = -jnp.linalg.solve(H, best.jacobian.T @ best.residual)
        q = normalise(body.topology, retract(body.topology, best.q, delta))
        r, J = _residual_and_jacobian(body, chosen, target, q)
        new = _Fit(q, r, J, (r**2).sum(), best.damping / 4)
        better = new.cost < best.cost
        kept = best._replace(damping=best.damping * 6)
        return jax.tree.map(lambda a, b: jnp.where(better, a, b), new, kept)

    # Starting from a zero derivative and an infinite cost makes the first step stay at q, so that
    # the kinematics is compiled once.
    rows = 6 * len(target.position) + jax.eval_shape(partial(_soft_residual, body), q).shape[0]
    start = _Fit(q, jnp.zeros(rows), jnp.zeros((rows, body.nv)), jnp.array(jnp.inf),
                 jnp.array(1e-3))  # fmt: skip
    return jax.lax.fori_loop(0, _ITERATIONS + 1, iterate, start)


def _residual_and_jacobian(
    body: Body, chosen: Array, target: _Targets, q: Array
) -> tuple[Array, Array]:
    """Residual (m) and its derivative (m nv) along tangent vectors, from the screws of `frames`."""
    out = frames(body, q)
    R, p = out.rotation[chosen], out.position[chosen]
    turn = so3.log(so3.matmul3(jnp.swapaxes(target.rotation, -1, -2), R))
    moved = jnp.asarray(body.topology.body_dofs)[chosen][..., None]  # (n nv 1)
    angular = jnp.where(moved, out.angular, 0.0)
    linear = jnp.where(moved, out.linear + so3.cross(out.angular, p[:, None]), 0.0)
    turn_jacobian = jnp.einsum(
        "nij,nkj,nvk->niv", so3.right_jacobian_inverse(turn), R, angular, optimize=True
    )
    soft = lambda d: _soft_residual(body, retract(body.topology, q, d))  # noqa: E731
    zero = jnp.zeros(body.nv, q.dtype)
    weighted = (target.weight @ turn[..., None]).ravel()
    residual = [weighted, _PER_METRE * (p - target.position).ravel(), soft(zero)]
    jacobian = [
        (target.weight @ turn_jacobian).reshape(-1, body.nv),
        _PER_METRE * jnp.swapaxes(linear, 1, 2).reshape(-1, body.nv),
        jax.jacfwd(soft)(zero),
    ]
    return jnp.concatenate(residual), jnp.concatenate(jacobian)


def _soft_residual(body: Body, q: Array) -> Array:
    """What holds joints that no segment determines: rest pose and limits."""
    rest = difference(body.topology, body.qpos0, q)[6:]
    beyond = _beyond_limits(body, q)
    return jnp.concatenate([_PER_RADIAN_FROM_REST * rest, _PER_RADIAN_BEYOND_LIMIT * beyond])


def _beyond_limits(body: Body, q: Array) -> Array:
    """How far each limited joint is beyond its limits [rad], hinges first."""
    topology = body.topology
    hinges = [j for j, kind in enumerate(topology.joint_types) if kind == HINGE]
    balls = [j for j, kind in enumerate(topology.joint_types) if kind == BALL]
    value = q[topology.joint_qpos[hinges]] if hinges else jnp.zeros(0)
    low, high = body.joint_range[jnp.array(hinges, int)].T
    over = [jnp.maximum(value - high, 0) + jnp.minimum(value - low, 0)]
    if balls:
        quats = q[topology.joint_qpos[balls][:, None] + np.arange(4)]
        squared = (jax.vmap(so3.quat_log)(quats) ** 2).sum(axis=-1)
        angle = jnp.sqrt(jnp.maximum(squared, 1e-12))  # the root's slope is infinite at zero
        over.append(jnp.maximum(angle - body.joint_range[jnp.array(balls), 1], 0))
    return jnp.concatenate(over)

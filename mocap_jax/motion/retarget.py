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
from mocap_jax.motion.pose_arrays import continuous_quaternions
from mocap_jax.motion.segment_match import SegmentMatch, match_segments
from mocap_jax.trajectory import Trajectory

# Weights of the residuals' parts: 0.1 rad of orientation counts as much as 2 cm of position;
# rest and limits are weak enough to cost a fraction of a degree where segments say otherwise.
_PER_RADIAN = 1.0
_PER_METRE = 5.0
_PER_RADIAN_FROM_REST = 0.02
_PER_RADIAN_BEYOND_LIMIT = 2.0
_FIRST_ITERATIONS, _ITERATIONS = 60, 6


class _Targets(NamedTuple):
    """World orientation and joint centre of each corresponding segment."""

    rotation: Float[Array, "*t n 3 3"]
    position: Float[Array, "*t n 3"]


def retarget(motion: Motion, body: Body) -> Motion:
    """Fit a motion to another body, by segment names.

    Args:
        motion: the clip; its body needs segments with Xsens, CMU, BVH or dm_control names.
        body: who shall perform it; with a free root.

    Returns:
        The motion of `body` at the same times. Its facts hold `orientation_error_mean_deg`,
        `orientation_error_max_deg`, `position_error_mean_cm`, `position_error_max_cm` (over all
        corresponding segments and frames, against the targets), `segments` and `scale`.

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


@partial(jax.jit, static_argnums=(0,))
def _segment_frames(topology_match: tuple[int, ...], body: Body, q: Array) -> _Targets:
    """Frames of the named bodies in all frames."""
    chosen = jnp.array(topology_match)

    def one(pose: Array) -> _Targets:
        out = frames(body, pose)
        return _Targets(out.rotation[chosen], out.position[chosen])

    return jax.vmap(one)(q)


def _targets(motion: Motion, match: SegmentMatch) -> _Targets:
    """What each segment of the target body should do, in all frames."""
    source = _segment_frames(tuple(match.source_body.tolist()), motion.body, motion.trajectory.q)
    R = jnp.einsum("tnij,njk->tnik", source.rotation, match.R_source_target)
    positions = [match.scale * source.position[:, 0]]
    for i in range(1, len(match.names)):
        p = match.parent[i]
        positions.append(positions[p] + R[:, p] @ match.offset[i])
    position = jnp.stack(positions, axis=1)
    feet = [i for i, name in enumerate(match.names) if name in ("LeftFoot", "RightFoot")]
    if feet:  # feet as high above the floor as the scaled source's are
        ankles = match.scale * source.position[:, jnp.array(feet), 2] + match.ankle_rise
        rise = jnp.median(ankles.min(axis=1) - position[:, jnp.array(feet), 2].min(axis=1))
        position = position.at[..., 2].add(rise)
    return _Targets(R, position)


@jax.jit
def _fit_clip(body: Body, chosen: Array, targets: _Targets) -> tuple[Array, Array, Array]:
    """Poses (t nq), orientation errors (t n) [rad] and position errors (t n) [m]."""
    first = jax.tree.map(lambda x: x[0], targets)
    root = jnp.concatenate([first.position[0], so3.quat_from_matrix(first.rotation[0])])
    q0 = body.qpos0.at[:7].set(root)
    q0 = _fit_frame(body, chosen, q0, first, _FIRST_ITERATIONS)

    def step(q: Array, target: _Targets) -> tuple[Array, tuple[Array, Array, Array]]:
        q = _fit_frame(body, chosen, q, target, _ITERATIONS)
        turn, shift = _errors(body, chosen, q, target)
        return q, (q, jnp.linalg.norm(turn, axis=-1), jnp.linalg.norm(shift, axis=-1))

    return jax.lax.scan(step, q0, targets)[1]


def _fit_frame(body: Body, chosen: Array, q: Array, target: _Targets, iterations: int) -> Array:
    """Levenberg-Marquardt with a fixed number of iterations; steps that do not help are undone."""
    residual = partial(_residual, body, chosen, target)

    def iterate(_: int, state: tuple[Array, Array]) -> tuple[Array, Array]:
        q, damping = state
        at = lambda d: residual(retract(body.topology, q, d))  # noqa: E731
        zero = jnp.zeros(body.nv, q.dtype)
        r, J = at(zero), jax.jacfwd(at)(zero)
        H = J.T @ J + damping * jnp.eye(body.nv)
        new = normalise(body.topology, retract(body.topology, q, -jnp.linalg.solve(H, J.T @ r)))
        better = (residual(new) ** 2).sum() < (r**2).sum()
        return jnp.where(better, new, q), jnp.where(better, damping / 4, damping * 6)

    return jax.lax.fori_loop(0, iterations, iterate, (q, jnp.asarray(1e-3, q.dtype)))[0]


def _errors(body: Body, chosen: Array, q: Array, target: _Targets) -> tuple[Array, Array]:
    """Rotation vector [rad] and displacement [m] of each segment from its target."""
    out = frames(body, q)
    relative = so3.matmul3(jnp.swapaxes(target.rotation, -1, -2), out.rotation[chosen])
    return so3.log(relative), out.position[chosen] - target.position


def _residual(body: Body, chosen: Array, target: _Targets, q: Array) -> Array:
    turn, shift = _errors(body, chosen, q, target)
    rest = difference(body.topology, body.qpos0, q)[6:]
    return jnp.concatenate(
        [
            _PER_RADIAN * turn.ravel(),
            _PER_METRE * shift.ravel(),
            _PER_RADIAN_FROM_REST * rest,
            _PER_RADIAN_BEYOND_LIMIT * _beyond_limits(body, q),
        ]
    )


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

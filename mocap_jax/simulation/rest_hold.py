"""The still hold at the start of a recording and the blend from it into the clip."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body, Topology
from mocap_jax.errors import InputError
from mocap_jax.motion import Motion
from mocap_jax.recording import RestHold
from mocap_jax.simulation.anatomy import Anatomy, anatomy_of
from mocap_jax.simulation.options import SimulationOptions
from mocap_jax.simulation.smoothing import bridge_jumps, low_pass
from mocap_jax.simulation.spline import PoseSpline

# The body stays still a little longer than declared, so that the declared interval is still
# to the last digit although the spline feels the start of the blend some knots before it.
_SETTLE = 0.15
# Fastest mean turn of a joint [rad/s] and walk of the root [m/s] during the blend.
_BLEND_SPEED = 1.2
# Joints reach the clip's first velocity and acceleration within these times [s]: spread over the
# whole blend, a fast start would swing them far back first.
_PICK_UP_SPEED, _PICK_UP_ACCELERATION = 0.5, 0.2


@dataclass(frozen=True)
class Performance:
    """What the body does during the recording: rest hold, blend, clip."""

    time: Float[np.ndarray, "t"]
    """Knots [s]."""
    q: Float[np.ndarray, "t nq"]
    rest: RestHold
    score_from: float
    cutoff_hz: float
    bridged_frames: int
    """Frames of the clip in which an impossibly fast joint was bridged."""

    def spline(self, topology: Topology) -> PoseSpline:
        """The whole performance as one spline."""
        return PoseSpline(topology, self.time, self.q)


def perform(
    motion: Motion, options: SimulationOptions, pose_error: Float[np.ndarray, "nv"] | None = None
) -> Performance:
    """Low-pass a clip and put the rest hold and a twice differentiable blend in front of it.

    Args:
        motion: the clip and its body.
        options: cut-off and durations.
        pose_error: what the held pose differs from the declared one by, in the tangent space of
            the declared pose [rad]; None for no difference.

    Raises:
        InputError: the clip is too short, not finite, not uniform in time or has no free root.
    """
    clip_time, clip = _checked(motion)
    topology = motion.body.topology
    step = float(clip_time[-1] - clip_time[0]) / (len(clip_time) - 1)
    clip, bridged = bridge_jumps(topology, clip, 1.0 / step, options.fastest_joint)
    clip, cutoff = low_pass(topology, clip, 1.0 / step, options.cutoff_hz)
    _, v, a = PoseSpline(topology, step * np.arange(len(clip)), clip).evaluate(np.zeros(1))
    declared = _standing(motion.body, clip)
    duration = _blend_duration(topology, declared, clip[0], options.blend_s)
    # A body that starts the clip at speed takes its run-up before the clip's first position.
    declared[:2] -= 0.5 * duration * v[0, :2]
    held = declared if pose_error is None else _moved(topology, declared, pose_error)
    still = int(np.ceil((options.rest_s + _SETTLE) / step))
    blend = max(int(np.ceil(duration / step)), 6)
    bridge = _blend(topology, held, clip[0], v[0], a[0], blend, step)
    q = np.concatenate([np.repeat(held[None], still, axis=0), bridge, clip])
    time = step * np.arange(len(q))
    rest = RestHold(0.0, options.rest_s, topology.by_joint(declared))
    return Performance(time, q, rest, float(time[still + blend]), cutoff, bridged)


def _checked(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    time, q = np.asarray(motion.trajectory.time), np.asarray(motion.trajectory.q)
    if not motion.body.has_free_root:
        raise InputError(f"motion '{motion.name}': its body has no free root joint")
    if len(time) < 8:
        raise InputError(f"motion '{motion.name}': {len(time)} frames, at least 8 are needed")
    if not (np.isfinite(q).all() and np.isfinite(time).all()):
        raise InputError(f"motion '{motion.name}': has values that are not finite")
    steps = np.diff(time)
    if steps.min() <= 0 or np.ptp(steps) > 0.01 * steps.mean():
        raise InputError(f"motion '{motion.name}': frames are not uniform in time")
    return time, q


def _standing(body: Body, clip: np.ndarray) -> np.ndarray:
    """Reference joint pose, upright where the clip starts, heading as there, feet on its floor."""
    anatomy = anatomy_of(body)
    q = np.array(body.qpos0)
    heading = _heading(anatomy, clip[0])
    upright = Rotation.from_euler("z", heading) * Rotation.from_matrix(anatomy.R_root_anatomy).inv()
    q[3:7] = upright.as_quat(scalar_first=True)
    q[:2] = clip[0, :2]
    data = mujoco.MjData(anatomy.model)
    frames = clip[:: max(1, len(clip) // 400)]
    q[2] += _lowest(anatomy.model, data, frames) - _lowest(anatomy.model, data, q[None])
    return q


def _lowest(model: mujoco.MjModel, data: mujoco.MjData, poses: np.ndarray) -> float:
    """Height of the lowest joint centre over some poses [m]."""
    lowest = np.inf
    for q in poses:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        lowest = min(lowest, float(data.xpos[1:, 2].min()))
    return lowest


def _heading(anatomy: Anatomy, q: np.ndarray) -> float:
    """Direction the body faces, about the vertical from world x [rad]."""
    R_world_anatomy = Rotation.from_quat(q[3:7], scalar_first=True).as_matrix() @ (
        anatomy.R_root_anatomy
    )
    forward, left = R_world_anatomy[:, 0], R_world_anatomy[:, 1]
    if np.hypot(*forward[:2]) > 0.5:
        return float(np.arctan2(forward[1], forward[0]))
    return float(np.arctan2(left[1], left[0]) - np.pi / 2)


def _blend_duration(
    topology: Topology, q_from: np.ndarray, q_to: np.ndarray, shortest: float
) -> float:
    """Long enough that nothing has to travel faster than people do on purpose [s]."""
    travel = np.abs(tangent_difference(topology, q_from, q_to))
    in_q, in_v = topology.quat_index
    turns = [np.linalg.norm(travel[i]) for i in in_v]
    return max(shortest, max([*travel[topology.scalar_index[1]], *turns]) / _BLEND_SPEED)


def _blend(
    topology: Topology,
    q_from: np.ndarray,
    q_to: np.ndarray,
    v_to: np.ndarray,
    a_to: np.ndarray,
    count: int,
    step: float,
) -> np.ndarray:
    """Quintic from rest to the clip's first pose, velocity and acceleration (`count` poses).

    The path runs in the tangent space at the clip's first pose, where the coordinates vanish at
    the end, so that their first and second derivatives there are v_to and a_to exactly.
    """
    start = tangent_difference(topology, q_to, q_from)
    duration = count * step
    to_speed = np.full(topology.nv, min(_PICK_UP_SPEED, duration))
    to_speed[:3] = duration
    to_acceleration = min(_PICK_UP_ACCELERATION, duration)
    before_end = duration - step * np.arange(count)[:, None]
    s = 1.0 - before_end / duration
    leave = 1 - 10 * s**3 + 15 * s**4 - 6 * s**5
    s = np.maximum(1.0 - before_end / to_speed, 0.0)
    speed = to_speed * (-4 * s**3 + 7 * s**4 - 3 * s**5)
    s = np.maximum(1.0 - before_end / to_acceleration, 0.0)
    bend = to_acceleration**2 * (0.5 * s**3 - s**4 + 0.5 * s**5)
    delta = leave * start + speed * v_to + bend * a_to
    return np.stack([_moved(topology, q_to, d) for d in delta])


def _moved(topology: Topology, q: np.ndarray, delta: np.ndarray) -> np.ndarray:
    """Pose q moved along a tangent vector."""
    out = np.array(q, float)
    in_q, in_v = topology.scalar_index
    out[in_q] += delta[in_v]
    for quat, dof in zip(*topology.quat_index, strict=True):
        turned = Rotation.from_quat(out[quat], scalar_first=True) * Rotation.from_rotvec(delta[dof])
        out[quat] = turned.as_quat(scalar_first=True)
    return out


def tangent_difference(
    topology: Topology, q_from: Float[np.ndarray, "nq"], q_to: Float[np.ndarray, "nq"]
) -> Float[np.ndarray, "nv"]:
    """Tangent vector at `q_from` that leads to `q_to`."""
    delta = np.zeros(topology.nv)
    in_q, in_v = topology.scalar_index
    delta[in_v] = q_to[in_q] - q_from[in_q]
    for quat, dof in zip(*topology.quat_index, strict=True):
        first = Rotation.from_quat(q_from[quat], scalar_first=True)
        second = Rotation.from_quat(q_to[quat], scalar_first=True)
        delta[dof] = (first.inv() * second).as_rotvec()
    return delta

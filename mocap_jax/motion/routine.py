"""A range-of-motion routine for any body: limb after limb, overlapping, every joint in turn.

Each joint swings as w(t) (c + a sin(2 pi f t + phase)) within two thirds of its range, with w a
smooth window that is zero at both ends, so that it starts and ends at rest in the body's qpos0.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.body.topology import BALL, FREE, HINGE
from mocap_jax.motion.pose_arrays import continuous_quaternions
from mocap_jax.motion.segment_names import xsens_name

DURATION = 30.0
"""Length of the routine [s]."""
RATE = 120.0
"""Frame rate [1/s]."""
_USED = 0.65
_FASTEST = 4.5
"""Bound on a joint's sinusoidal speed [rad/s]; windows add a little."""
_ACTIVE, _RAMP, _STILL = 11.0, 2.5, 0.5
_GOLDEN = (math.sqrt(5) - 1) / 2
_FREE_SWING = math.radians(35)

# Ranges of ball joints about the rest pose's world axes [deg]: flexion (about -Y), abduction (about
# X, outward), axial rotation (about Z); after AAOS 1965, trunk and neck joints' shares of it.
_BALL_RANGES = {
    "Neck": ((-25, 25), (-20, 20), (-30, 30)),
    "Head": ((-20, 20), (-15, 15), (-40, 40)),
    "UpperArm": ((-50, 140), (-10, 120), (-60, 60)),
    "UpperLeg": ((-20, 110), (-25, 40), (-35, 35)),
    "ForeArm": ((0, 140), (-5, 5), (-70, 70)),
    "Hand": ((-50, 50), (-15, 15), (-10, 10)),
    "LowerLeg": ((-120, 0), (-3, 3), (-10, 10)),
    "Foot": ((-35, 20), (-15, 15), (-10, 10)),
}  # fmt: skip
_OTHER_BALL_RANGES = ((-18, 18), (-15, 15), (-15, 15))


def routine_poses(body: Body) -> tuple[Float[np.ndarray, "t"], Float[np.ndarray, "t nq"]]:
    """Times [s] and poses of the routine for a body."""
    topology = body.topology
    time = np.arange(round(DURATION * RATE) + 1) / RATE
    rest = np.asarray(body.qpos0)
    R_world_rest = _rest_rotations(body)
    limbs = _limbs(body)
    q = np.tile(rest, (len(time), 1))
    for j, kind in enumerate(topology.joint_types):
        start = topology.joint_qpos[j]
        window = _window(time, limbs[topology.joint_body[j]], max(limbs.values()) + 1)
        if kind == FREE:
            q[:, start : start + 7] = _wander(time, rest[start : start + 7])
        elif kind == BALL:
            w_world = window[:, None] * _ball_swing(body, j, time)
            local = w_world @ R_world_rest[topology.joint_body[j]]
            turn = Rotation.from_rotvec(local)
            zero = Rotation.from_quat(rest[start : start + 4], scalar_first=True)
            q[:, start : start + 4] = (zero * turn).as_quat(scalar_first=True)
        else:
            low, high = _hinge_range(body, j, rest[start])
            q[:, start] += window * _swing(time, low, high, j)
    return time, continuous_quaternions(topology, q)


def _rest_rotations(body: Body) -> Float[np.ndarray, "nbody 3 3"]:
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return data.xmat.reshape(-1, 3, 3).copy()


def _limbs(body: Body) -> dict[int, int]:
    """Number of the limb of each body: a limb goes on while its segments have one moving child."""
    topology = body.topology
    moving = {int(b) for b in topology.joint_body}
    for b in reversed(range(1, topology.nbody)):  # a welded segment moves what it carries
        if b in moving:
            moving.add(topology.body_parent[b])
    children = {b: [c for c in sorted(moving) if c and topology.body_parent[c] == b]
                for b in range(topology.nbody)}  # fmt: skip
    limbs: dict[int, int] = {0: 0}
    count = 0
    for b in range(1, topology.nbody):
        parent = topology.body_parent[b]
        if parent <= 1 or len(children[parent]) > 1:
            limbs[b] = count
            count += 1
        else:
            limbs[b] = limbs[parent]
    return limbs


def _window(time: Float[np.ndarray, "t"], limb: int, count: int) -> Float[np.ndarray, "t"]:
    """One while the limb is active, zero elsewhere, with ramps of continuous acceleration."""
    room = DURATION - 2 * _STILL - _ACTIVE
    begin = _STILL + room * (limb / max(count - 1, 1))
    return _smooth_step((time - begin) / _RAMP) * _smooth_step((begin + _ACTIVE - time) / _RAMP)


def _smooth_step(x: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t"]:
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10 - 15 * x + 6 * x**2)


def _swing(
    time: Float[np.ndarray, "t"], low: float, high: float, number: int
) -> Float[np.ndarray, "t"]:
    """Sinusoid [rad] between used shares of two limits, of 0.3-1 Hz unless that is too fast."""
    centre, amplitude = _USED * (low + high) / 2, _USED * (high - low) / 2
    frequency = 0.3 + 0.7 * ((number * _GOLDEN) % 1.0)
    fastest = _FASTEST / (2 * math.pi * max(amplitude, 1e-9))
    phase = 2 * math.pi * ((number * _GOLDEN**2) % 1.0)
    return centre + amplitude * np.sin(2 * math.pi * min(frequency, fastest) * time + phase)


def _hinge_range(body: Body, joint: int, rest: float) -> tuple[float, float]:
    """Limits of a hinge or slide joint about its rest value."""
    low, high = (float(x) for x in body.joint_range[joint])
    if not (math.isfinite(low) and math.isfinite(high)):
        swing = _FREE_SWING if body.topology.joint_types[joint] == HINGE else 0.05
        return -swing, swing
    return low - rest, high - rest


def _ball_swing(body: Body, joint: int, time: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t 3"]:
    """Rotation vector [rad] about the rest pose's world axes, within the joint's own limit."""
    segment = xsens_name(body.topology.body_names[body.topology.joint_body[joint]])
    side = -1.0 if segment.startswith("Right") else 1.0
    ranges = _BALL_RANGES.get(segment.removeprefix("Left").removeprefix("Right"),
                              _OTHER_BALL_RANGES)  # fmt: skip
    flexion, abduction, rotation = (
        # Three axes move at once: each takes a share of the speed.
        _swing(time, math.radians(low), math.radians(high), 3 * joint + i) / math.sqrt(3)
        for i, (low, high) in enumerate(ranges)
    )
    w = np.stack([side * abduction, -flexion, side * rotation], axis=1)
    limit = _USED * float(body.joint_range[joint][1])
    largest = np.linalg.norm(w, axis=1).max()
    return w * min(1.0, limit / largest)


def _wander(time: Float[np.ndarray, "t"], rest: Float[np.ndarray, "7"]) -> Float[np.ndarray, "t 7"]:
    """Root pose: sways by centimetres, turns by some 40 degrees, leans a little."""
    ends = _smooth_step((time - _STILL) / 4) * _smooth_step((DURATION - _STILL - time) / 4)
    wave = lambda f, phase: np.sin(2 * math.pi * f * time + phase)  # noqa: E731
    shift = np.stack([0.15 * wave(0.11, 0.3), 0.15 * wave(0.13, 1.7), 0.03 * wave(0.31, 0.9)], 1)
    lean = np.stack([0.08 * wave(0.29, 0.5), 0.10 * wave(0.23, 2.1), 0.70 * wave(0.09, 1.0)], 1)
    R = Rotation.from_rotvec(ends[:, None] * lean) * Rotation.from_quat(rest[3:], scalar_first=True)
    return np.hstack([rest[:3] + ends[:, None] * shift, R.as_quat(scalar_first=True)])

"""Level walking of the `human` body from published joint angle curves.

Knee and ankle angles of natural cadence approximate (to some two degrees) the mean curves of Winter
1991, The Biomechanics and Motor Control of Human Gait; thigh, pelvis, trunk and arm follow the
description in Perry 1992, Gait Analysis. Curves are Fourier series of six harmonics.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion.pose_arrays import continuous_quaternions

SPEED = 1.3
"""Walking speed [m/s] of a person 1.75 m tall; proportional to stature."""
DURATION = 10.0
"""Length of the motion [s]."""
RATE = 120.0
"""Frame rate [1/s]."""
_CYCLE = 1.06
"""Stride time [s]."""
_ROOT_HEIGHT = 0.530
"""Height of the pelvis of `human()` at rest, as a fraction of stature."""
_HARMONICS = 6

# Right leg, degrees at 0, 5, ... 95 % of the stride from heel contact; flexion positive.
# The thigh's angle is to the vertical: only so do steps and walking speed agree.
_THIGH = (20.5, 21, 20, 16.5, 11.5, 6, 0.5, -5.5, -11, -16,
          -19, -18, -12, -2.5, 8, 17, 23, 25.5, 25, 22.5)  # fmt: skip
_KNEE = (4, 9, 16, 18, 16.5, 13.5, 10, 7.5, 6.5, 8,
         12.5, 22, 35, 50, 60, 62, 55, 40, 21, 6)  # fmt: skip
_ANKLE = (0, -4, -3, 0.5, 3.5, 5.5, 7, 8, 9, 9.5,
          7.5, 0, -12, -19, -15, -8, -3, 0, 1, 0.5)  # fmt: skip
_TOE = (5, 2, 0, 0, 0, 0, 0, 2, 5, 10, 19, 31, 36, 22, 8, 4, 6, 10, 12, 9)


def walking_poses(body: Body) -> tuple[Float[np.ndarray, "t"], Float[np.ndarray, "t nq"]]:
    """Times [s] and poses of straight walking along X.

    Raises:
        InputError: the body lacks joints of `human()`.
    """
    time = np.arange(round(DURATION * RATE) + 1) / RATE
    q = np.tile(np.asarray(body.qpos0), (len(time), 1))
    for joint, angle in _hinge_angles(time / _CYCLE).items():
        q[:, _start(body, joint)] = np.radians(angle)
    for joint, (flexion, lateral, axial) in _ball_angles(time / _CYCLE).items():
        start = _start(body, joint)
        R = Rotation.from_euler("ZXY", np.radians(np.stack([axial, lateral, -flexion], 1)))
        q[:, start : start + 4] = R.as_quat(scalar_first=True)
    q[:, :7] = _pelvis(body, time, q)
    return time, continuous_quaternions(body.topology, q)


def _start(body: Body, joint: str) -> int:
    if joint not in body.topology.joint_names:
        raise InputError(f"walking is for the body of human(); this one has no joint '{joint}'")
    return int(body.topology.joint_qpos[body.topology.joint_names.index(joint)])


def _curve(values: tuple[float, ...], cycle: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t"]:
    """Periodic curve through samples of one stride, as a truncated Fourier series."""
    c = np.fft.rfft(values) / len(values)
    angle = 2 * math.pi * np.outer(cycle, np.arange(1, _HARMONICS + 1))
    harmonics = c[1 : _HARMONICS + 1]
    return c[0].real + 2 * (np.cos(angle) @ harmonics.real - np.sin(angle) @ harmonics.imag)


def _wave(cycle: Float[np.ndarray, "t"], share: float) -> Float[np.ndarray, "t"]:
    """Cosine of one period a stride that peaks at a share of it."""
    return np.cos(2 * math.pi * (cycle - share))


def _hinge_angles(cycle: Float[np.ndarray, "t"]) -> dict[str, Float[np.ndarray, "t"]]:
    """Hinge angles [deg]; the left side lags by half a stride."""
    angles = {}
    for side, phase in (("Right", cycle), ("Left", cycle + 0.5)):
        angles[f"{side}LowerLeg_flexion"] = _curve(_KNEE, phase)
        angles[f"{side}Foot_dorsiflexion"] = _curve(_ANKLE, phase)
        angles[f"{side}Toe_extension"] = _curve(_TOE, phase)
        # The arm is furthest forward when the same side's leg is furthest back.
        angles[f"{side}ForeArm_flexion"] = 25 + 12 * _wave(phase, 0.52)
        angles[f"{side}ForeArm_pronation"] = 15 + 0 * phase
        angles[f"{side}Shoulder_protraction"] = 3 * _wave(phase, 0.5)
    return angles


def _ball_angles(
    cycle: Float[np.ndarray, "t"],
) -> dict[str, tuple[Float[np.ndarray, "t"], ...]]:
    """Flexion (forward), lateral (about X) and axial (about Z) angles [deg] of ball joints."""
    angles = {}
    for side, phase, left in (("Right", cycle, -1), ("Left", cycle + 0.5, 1)):
        # The pelvis' own turns are taken back out.
        angles[f"{side}UpperLeg"] = (
            _curve(_THIGH, phase), _OBLIQUITY * _wave(cycle, 0.12), -_TURN * _wave(cycle, 0.0),
        )  # fmt: skip
        arm = 2 + 17 * _wave(phase, 0.5)
        angles[f"{side}UpperArm"] = (arm, np.full_like(arm, 7.0 * left), 0 * arm)
    for joint in ("L5", "L3", "T12", "T8"):
        # Shoulders turn against the pelvis, and the trunk stays upright over its tilting.
        counter = -_wave(cycle, 0.0) * (_TURN + 4) / 4
        angles[joint] = (0 * cycle, _OBLIQUITY / 4 * _wave(cycle, 0.12), counter)
    for joint in ("Neck", "Head"):
        angles[joint] = (-1.0 + 0 * cycle, 0 * cycle, 2.0 * _wave(cycle, 0.0))
    return angles


_TURN = 4.0
"""Axial rotation of the pelvis [deg], right side forward at right heel contact."""
_OBLIQUITY = 3.5
"""Drop of the pelvis [deg] on the swing side, greatest soon after heel contact."""


def _pelvis(
    body: Body, time: Float[np.ndarray, "t"], q: Float[np.ndarray, "t nq"]
) -> Float[np.ndarray, "t 7"]:
    """Root pose: steady speed, sway over the stance foot, height that keeps soles on the floor."""
    cycle, stature = time / _CYCLE, float(body.qpos0[2]) / _ROOT_HEIGHT
    axial, lateral = _TURN * _wave(cycle, 0.0), -_OBLIQUITY * _wave(cycle, 0.12)
    R = Rotation.from_euler("ZX", np.radians(np.stack([axial, lateral], 1)))
    # Right foot bears from 0 to 0.6 of the stride: the pelvis is over it (at -Y) at 0.3.
    sway = -0.0125 * stature * _wave(cycle, 0.3)
    position = np.stack([SPEED * stature / 1.75 * time, sway, np.zeros_like(time)], axis=1)
    pose = np.hstack([position, R.as_quat(scalar_first=True)])
    pose[:, 2] = _standing_height(body, time, np.hstack([pose, q[:, 7:]]))
    return pose


def _standing_height(
    body: Body, time: Float[np.ndarray, "t"], q: Float[np.ndarray, "t nq"]
) -> Float[np.ndarray, "t"]:
    """Root height [m] at which the lower foot is on the floor, smoothed to four harmonics."""
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    stride = round(_CYCLE * RATE)
    drop = np.empty(stride)
    for k in range(stride):
        data.qpos = q[k]
        mujoco.mj_kinematics(model, data)
        reach = model.geom_size[:, 1] * np.abs(data.geom_xmat[:, 8])
        drop[k] = -(data.geom_xpos[:, 2] - model.geom_size[:, 0] - reach).min()
    c = np.fft.rfft(drop) / stride
    angle = 2 * math.pi * np.outer(time / _CYCLE, [2, 4])
    return c[0].real + 2 * (np.cos(angle) @ c[[2, 4]].real - np.sin(angle) @ c[[2, 4]].imag)

"""Somebody who writes on a board: inverse kinematics of the built-in human."""

from __future__ import annotations

import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Float

import mocap_jax as mj
from mocap_jax.motion import Motion
from sip2017.letters import RATE, Path, write

# Middle of the writing: this far in front of the right shoulder, to its left, and below it [m].
_BOARD = (0.40, 0.06, 0.06)
# How much each joint resists, [1/rad] against 1/`_CLOSE` metres: the arm writes, the trunk helps.
_STIFFNESS = {
    "L5": 2.5, "L3": 2.5, "T12": 2.5, "T8": 2.5, "RightShoulder": 1.5, "RightUpperArm": 0.35,
    "RightForeArm": 0.35, "RightHand": 2.0,
}  # fmt: skip
_CLOSE = 0.002
_READY = {"RightForeArm_flexion": 80.0, "RightForeArm_pronation": 40.0}
_ARM_RAISED = (0.35, -0.75, 0.0)  # rotation vector of the upper arm [rad]
_STEPS = 8


def writing_motion(word: str = "mocap") -> tuple[Motion, Path]:
    """The built-in human writes a word with its right wrist, at 120 Hz, and the wrist's path.

    The board stands upright in front (normal to X). The person stands still but for the right arm
    and a trunk that follows it.
    """
    body, path = mj.human(), write(word)
    reach = Reach(body)
    shoulder = reach.place("RightUpperArm", np.asarray(body.qpos0))
    middle = shoulder + [_BOARD[0], _BOARD[1], -_BOARD[2]]
    target = middle + np.stack([-path.off, -path.across, path.up], axis=1)
    q = reach.follow(target)
    facts: dict[str, str | float | int | bool] = {"word": word, "frame_rate_hz": RATE}
    time = jnp.arange(len(q)) / RATE
    return Motion(f"writing {word}", body, mj.Trajectory(time, jnp.asarray(q)), facts), path


class Reach:
    """Poses that bring the right wrist to a place, as near as can be to a posture."""

    def __init__(self, body: mj.Body) -> None:
        self.model = body.mujoco_model()
        self.data = mujoco.MjData(self.model)
        self.posture = _ready(self.model, np.array(body.qpos0))
        dofs = {
            i: stiffness
            for name, stiffness in _STIFFNESS.items()
            for i in _dofs(self.model, self.model.body(name).id)
        }
        self.dofs, self.stiffness = np.array(list(dofs)), np.array(list(dofs.values()))
        self.wrist = self.model.body("RightHand").id

    def place(self, segment: str, q: np.ndarray) -> Float[np.ndarray, "3"]:
        """Where a segment's joint is [m]."""
        self._pose(q)
        return self.data.xpos[self.model.body(segment).id].copy()

    def follow(self, target: Float[np.ndarray, "t 3"]) -> Float[np.ndarray, "t nq"]:
        """Poses for a path, each from the last."""
        q, poses = self.posture, []
        for place in target:
            for _ in range(_STEPS if poses else 10 * _STEPS):
                q = self._step(q, place)
            poses.append(q)
        return np.array(poses)

    def _step(self, q: np.ndarray, place: np.ndarray) -> np.ndarray:
        """One step of Gauss and Newton, at most a fifth of a radian."""
        self._pose(q)
        away, jacobian = np.zeros(self.model.nv), np.zeros((3, self.model.nv))
        mujoco.mj_differentiatePos(self.model, away, 1.0, self.posture, q)
        mujoco.mj_jacBody(self.model, self.data, jacobian, None, self.wrist)
        J = np.concatenate([jacobian[:, self.dofs] / _CLOSE, np.diag(self.stiffness)])
        miss = (self.data.xpos[self.wrist] - place) / _CLOSE
        r = np.concatenate([miss, self.stiffness * away[self.dofs]])
        step = np.zeros(self.model.nv)
        step[self.dofs] = -np.linalg.lstsq(J, r, rcond=None)[0]
        step *= min(1.0, 0.2 / max(np.abs(step).max(), 1e-9))
        moved = q.copy()
        mujoco.mj_integratePos(self.model, moved, step, 1.0)
        return moved

    def _pose(self, q: np.ndarray) -> None:
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)


def _ready(model: mujoco.MjModel, q: np.ndarray) -> np.ndarray:
    """Standing, the right arm before the chest."""
    for joint, degrees in _READY.items():
        q[model.joint(joint).qposadr[0]] = np.radians(degrees)
    turn = np.zeros(4)
    angle = float(np.linalg.norm(_ARM_RAISED))
    mujoco.mju_axisAngle2Quat(turn, np.array(_ARM_RAISED) / angle, angle)
    at = model.joint("RightUpperArm").qposadr[0]
    q[at : at + 4] = turn
    return q


def _dofs(model: mujoco.MjModel, segment: int) -> range:
    first = int(model.body_dofadr[segment])
    return range(first, first + int(model.body_dofnum[segment]))

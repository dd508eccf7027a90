"""Where the body faces at rest, and how far limbs are turned about the vertical.

A pose that is said ("standing, arms hanging") says little of turns about the vertical: toes point
outwards, arms hang with the elbows turned outwards. Knees and elbows bend about axes that lie
across the body in the model; where they lie in the person says where the person faces, and what is
left of each limb is its own turn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, frames
from mocap_jax.initialise.mounting.hinge_axis import HingeAxis
from mocap_jax.motion import xsens_name

# How far limbs are turned in a pose that was not said exactly [rad]: legs stand about straight,
# arms hang as they like.
_LEGS, _ARMS = np.deg2rad(10.0), np.deg2rad(30.0)
# An axis steeper than this tells no heading (cosine of its slope).
_LEVEL = 0.6
# Limbs farther from the others than this count little [rad].
_APART = np.deg2rad(45.0)
# A limb turned farther is not believed [rad].
_MOST = np.deg2rad(75.0)


@dataclass(frozen=True)
class LimbTurn:
    """How far a limb is turned about the vertical against the pose, as its hinge shows it."""

    sensor: str
    """Above the hinge."""
    below: str
    """Sensor below the hinge."""
    hinge: HingeAxis
    angle: float
    """As measured, before the body's own facing is taken off [rad]."""
    apart: float
    """How far what the two sensors say is apart [rad]."""
    std: float
    """[rad]"""


@dataclass(frozen=True)
class Facing:
    """Turn about the vertical that brings measured orientations to where the pose faces."""

    angle: float
    """[rad]"""
    std: float
    """[rad]"""
    source: str
    """What says so, in words."""


def limb_turns(
    body: Body, pose: Float[np.ndarray, "nq"], segments: Mapping[str, str],
    hinges: Mapping[tuple[str, str], HingeAxis], R_world_sensor: Mapping[str, np.ndarray],
    std: Mapping[str, float],
) -> tuple[LimbTurn, ...]:  # fmt: skip
    """Turns of the limbs that have a hinge whose axis is level at rest.

    Args:
        body: whose hinges they are.
        pose: q at rest.
        segments: of the sensors.
        hinges: by the sensors above and below.
        R_world_sensor: at rest, in one world for all.
        std: of the sensors' headings [rad].
    """
    rotation = np.asarray(frames(body, pose).rotation)
    out = []
    for (above, below), hinge in hinges.items():
        joint = body.topology.joint_index(hinge.joint)
        b = body.topology.joint_body[joint]
        model = rotation[b] @ np.asarray(body.joint_axis)[joint]
        axes = R_world_sensor[above] @ hinge.in_first, R_world_sensor[below] @ hinge.in_second
        if min(np.hypot(*v[:2]) for v in (model, *axes)) < _LEVEL:
            continue
        first, second = (_turn(model, v) for v in axes)
        apart = _wrapped(second - first)
        out.append(
            LimbTurn(
                above, below, hinge, _wrapped(first + apart / 2), abs(apart),
                float(np.hypot(np.hypot(hinge.std, apart / 2), std[above])),
            )
        )  # fmt: skip
    return tuple(out)


def where_it_faces(turns: tuple[LimbTurn, ...], segments: Mapping[str, str]) -> Facing | None:
    """The facing that limbs say together; None without any."""
    if not turns:
        return None
    spread = [_ARMS if "Arm" in xsens_name(segments[t.sensor]) else _LEGS for t in turns]
    weight = np.array([1 / (t.std**2 + s**2) for t, s in zip(turns, spread, strict=True)])
    angles = np.exp(1j * np.array([t.angle for t in turns]))
    # One limb whose hinge was taken wrongly must not turn the body.
    tried = np.exp(1j * np.deg2rad(np.arange(360.0)))
    away = np.abs(np.angle(tried[:, None] / angles))
    best = tried[np.argmax((weight / (1 + (away / _APART) ** 2)).sum(axis=1))]
    weight = weight / (1 + (np.abs(np.angle(best / angles)) / _APART) ** 2) ** 2
    mean = np.sum(weight * angles)
    names = ", ".join(t.hinge.joint for t in turns)
    return Facing(float(-np.angle(mean)), float(weight.sum() ** -0.5), f"axes of {names}")


def believed(turn: LimbTurn, facing: Facing) -> float | None:
    """A limb's own turn [rad]; None where it is too far to be one."""
    own = _wrapped(turn.angle + facing.angle)
    return own if abs(own) < _MOST else None


def _turn(a: np.ndarray, b: np.ndarray) -> float:
    """From the horizontal part of a to that of b [rad]."""
    return float(np.arctan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]))


def _wrapped(angle: float) -> float:
    return float(np.mod(angle + np.pi, 2 * np.pi) - np.pi)

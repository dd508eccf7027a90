"""Anatomical directions of a body, found from where its joints are."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.motion import xsens_name

_PAIRS = (
    ("LeftUpperLeg", "RightUpperLeg"),
    ("LeftUpperArm", "RightUpperArm"),
    ("LeftFoot", "RightFoot"),
)
_ABOVE = ("Head", "Neck", "T8", "T12", "L3", "L5")
_BELOW = ("LeftLowerLeg", "LeftFoot", "Pelvis", "L5")


@dataclass(frozen=True)
class Anatomy:
    """Reference-pose geometry of a body, in world coordinates at `qpos0`."""

    model: mujoco.MjModel
    data: mujoco.MjData
    """At the reference pose, positions computed."""
    segments: dict[str, int]
    """Body index of each segment, by Xsens name and by its own name."""
    forward: Float[np.ndarray, "3"]
    left: Float[np.ndarray, "3"]
    up: Float[np.ndarray, "3"]

    def position(self, segment: str) -> Float[np.ndarray, "3"]:
        """World position of a segment's frame."""
        return self.data.xpos[self.segments[segment]]

    def rotation(self, body: int) -> Float[np.ndarray, "3 3"]:
        """R_world_body of a body by index."""
        return self.data.xmat[body].reshape(3, 3)

    @property
    def R_root_anatomy(self) -> Float[np.ndarray, "3 3"]:
        """Columns: forward, left, up in the frame of the root segment."""
        return self.rotation(1).T @ np.column_stack([self.forward, self.left, self.up])


def anatomy_of(body: Body) -> Anatomy:
    """Find left, up and forward (left x up) of a body from its joint centres at `qpos0`.

    Bodies without left and right limbs count as facing world x with world z up.
    """
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    names = body.topology.body_names
    segments = {name: i for i, name in enumerate(names) if i}
    for i, name in enumerate(names):
        if i:
            segments.setdefault(xsens_name(name), i)
    at = lambda name: data.xpos[segments[name]]  # noqa: E731
    pair = next((p for p in _PAIRS if p[0] in segments and p[1] in segments), None)
    above = next((n for n in _ABOVE if n in segments), None)
    below = next((n for n in _BELOW if n in segments), None)
    left, up = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    if pair is not None and above is not None and below is not None:
        left = at(pair[0]) - at(pair[1])
        left = left / np.linalg.norm(left)
        up = at(above) - 0.5 * (at(below) + at(below.replace("Left", "Right")))
        up = up - left * (left @ up)
        up = up / np.linalg.norm(up)
    return Anatomy(model, data, segments, np.cross(left, up), left, up)

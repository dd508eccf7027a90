"""Which segments of two bodies correspond, and how their frames are turned to each other.

Rest poses and frames differ between skeletons (T-pose, N-pose, splayed legs). Both rest poses are
first brought to X forward, Y left, Z up by their own anatomy (hips and trunk). The second body's
segment is then turned by the smallest rotation that brings its long axis, from its joint to the
next one that both bodies have, onto the first body's; arms thus swing sideways from hanging to
horizontal, palms from the thighs to the floor. Pelvis and trunk corners keep the anatomical frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion.segment_names import unique_xsens_names

_SHORTEST_AXIS = 0.01  # [m]: below, a segment has no direction of its own
_MIDDLE = ("Neck", "Head", "T8", "T12", "L3", "L5")


@dataclass(frozen=True)
class RestPose:
    """Body frames at qpos0, turned to X forward, Y left, Z up; index by Xsens segment name."""

    index: dict[str, int]
    """MuJoCo body of each segment."""
    rotation: dict[str, Float[np.ndarray, "3 3"]]
    position: dict[str, Float[np.ndarray, "3"]]
    lowest: float
    """Height of the lowest joint centre [m]."""


@dataclass(frozen=True)
class SegmentMatch:
    """Corresponding segments, parents first (the pelvis is the first)."""

    names: tuple[str, ...]
    parent: tuple[int, ...]
    """Position in `names` of each segment's nearest ancestor that both bodies have; -1: none."""
    source_body: np.ndarray
    target_body: np.ndarray
    R_source_target: Float[np.ndarray, "n 3 3"]
    """Orientation that the target's segment should have in the source's segment frame."""
    offset: Float[np.ndarray, "n 3"]
    """Joint centre in the parent segment's frame, on the target at rest [m]."""
    scale: float
    """Target's leg length over the source's."""
    ankle_rise: float
    """Ankle height of the target above the scaled source's [m]."""


def match_segments(source: Body, target: Body) -> SegmentMatch:
    """Match two bodies by Xsens names.

    Raises:
        InputError: a body lacks pelvis, thighs or trunk, or fewer than six segments correspond.
    """
    first, second = rest_pose(source, "the motion's body"), rest_pose(target, "the target body")
    names = tuple(n for n in second.index if n in first.index)
    if len(names) < 6 or names[0] != "Pelvis":
        raise InputError(
            f"only {len(names)} segments correspond ({', '.join(names)}); retargeting needs a "
            "Pelvis root and six or more segments with Xsens, CMU or BVH names in both bodies"
        )
    parent = tuple(_parent(target, second, names, name) for name in names)
    alignment = _alignments(first, second, names, parent)
    R_source_target = [
        first.rotation[n].T @ Q @ second.rotation[n] for n, Q in zip(names, alignment, strict=True)
    ]
    offset = [
        np.zeros(3)
        if p < 0
        else second.rotation[names[p]].T @ (second.position[n] - second.position[names[p]])
        for n, p in zip(names, parent, strict=True)
    ]
    scale = _leg(second) / _leg(first)
    return SegmentMatch(
        names, parent,
        np.array([first.index[n] for n in names]), np.array([second.index[n] for n in names]),
        np.array(R_source_target), np.array(offset), scale,
        _ankle(second) - scale * _ankle(first),
    )  # fmt: skip


def rest_pose(body: Body, what: str) -> RestPose:
    """Rest pose of a body, upright; `what` names it in errors."""
    names = unique_xsens_names(list(body.topology.body_names[1:]))
    index = {name: i + 1 for i, name in enumerate(names)}
    missing = [n for n in ("Pelvis", "LeftUpperLeg", "RightUpperLeg") if n not in index]
    middle = next((n for n in _MIDDLE if n in index), None)
    if missing or middle is None:
        raise InputError(
            f"{what} has no segment {missing[0] if missing else 'T8, Neck or Head'}; "
            f"its segments: {', '.join(names)}"
        )
    model = body.mujoco_model()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    R_up_world = _upright(*(data.xpos[index[n]] for n in
                            ("LeftUpperLeg", "RightUpperLeg", middle)))  # fmt: skip
    position = data.xpos @ R_up_world.T
    rotation = R_up_world @ data.xmat.reshape(-1, 3, 3)
    return RestPose(
        index,
        {n: rotation[i] for n, i in index.items()},
        {n: position[i] for n, i in index.items()},
        float(position[1:, 2].min()),
    )


def _upright(
    left: Float[np.ndarray, "3"], right: Float[np.ndarray, "3"], top: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3 3"]:
    """Rotation to X forward, Y left (through the hips), Z up."""
    y = (left - right) / np.linalg.norm(left - right)
    up = top - (left + right) / 2
    x = np.cross(y, up)
    x /= np.linalg.norm(x)
    return np.stack([x, y, np.cross(x, y)])


def _parent(target: Body, rest: RestPose, names: tuple[str, ...], name: str) -> int:
    by_index = {rest.index[n]: i for i, n in enumerate(names)}
    b = target.topology.body_parent[rest.index[name]]
    while b and b not in by_index:
        b = target.topology.body_parent[b]
    return by_index.get(b, -1)


def _alignments(
    first: RestPose, second: RestPose, names: tuple[str, ...], parent: tuple[int, ...]
) -> list[Float[np.ndarray, "3 3"]]:
    """Rotation of each target segment, both upright, that brings its axis onto the source's."""
    result: list[Float[np.ndarray, "3 3"]] = []
    for i, name in enumerate(names):
        children = [n for n, p in zip(names, parent, strict=True) if p == i]
        child = next((n for n in _MIDDLE if n in children), children[0] if children else None)
        if i == 0:
            result.append(np.eye(3))
            continue
        axes = [np.zeros(3), np.zeros(3)]
        if child:
            axes = [rest.position[child] - rest.position[name] for rest in (first, second)]
        if min(np.linalg.norm(a) for a in axes) < _SHORTEST_AXIS:
            result.append(result[parent[i]])  # no axis of its own: carried along
        else:
            result.append(_smallest_rotation(axes[1], axes[0]))
    return result


def _smallest_rotation(
    start: Float[np.ndarray, "3"], end: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3 3"]:
    start, end = start / np.linalg.norm(start), end / np.linalg.norm(end)
    normal = np.cross(start, end)
    sine = np.linalg.norm(normal)
    if sine < 1e-9:
        return np.eye(3)
    angle = np.arctan2(sine, start @ end)
    return Rotation.from_rotvec(normal / sine * angle).as_matrix()


def _leg(rest: RestPose) -> float:
    """Length of the left leg [m], hip to ankle, or to the lowest joint without named segments."""
    chain = [rest.position[n] for n in ("LeftUpperLeg", "LeftLowerLeg", "LeftFoot")
             if n in rest.position]  # fmt: skip
    if len(chain) < 3:
        return float(chain[0][2] - rest.lowest)
    return float(sum(np.linalg.norm(b - a) for a, b in zip(chain, chain[1:], strict=False)))


def _ankle(rest: RestPose) -> float:
    """Height of the ankle above the lowest joint centre [m]."""
    ankle = rest.position.get("LeftFoot")
    return 0.0 if ankle is None else float(ankle[2] - rest.lowest)

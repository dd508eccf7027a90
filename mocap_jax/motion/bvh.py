"""Biovision hierarchies (`.bvh`): skeleton and motion in one file.

A joint's rotation is the product of its rotation channels in the order listed. Joints that move
become ball joints; a joint that keeps one rotation through the whole clip (within 1e-6 rad) is
welded in it, so the body depends on the clip.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion.motion import Motion
from mocap_jax.motion.pose_arrays import assemble_poses
from mocap_jax.motion.segment_names import unique_xsens_names
from mocap_jax.motion.shapes import segment_shapes
from mocap_jax.motion.skeleton import R_WORLD_FILE, Bone, Joint, Skeleton, skeleton_body
from mocap_jax.motion.text_file import LineReader, read_lines
from mocap_jax.trajectory import Trajectory

CMU_UNIT = 0.0254 / 0.45
"""Metres per unit of length in the CMU database's ASF files and BVH conversions of them."""
CENTIMETRE = 0.01
_TALLEST_IN_CMU_UNITS = 30.0
_STILL = 1e-6
_POSITIONS = ("Xposition", "Yposition", "Zposition")
_ROTATIONS = ("Xrotation", "Yrotation", "Zrotation")


@dataclass
class BvhJoint:
    """One joint of the hierarchy; lengths in file units."""

    name: str
    parent: int
    """Index of the parent joint, -1 for the root."""
    offset: Float[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))
    channels: tuple[str, ...] = ()
    first_column: int = 0
    end_site: Float[np.ndarray, "3"] | None = None


@dataclass(frozen=True)
class Bvh:
    """A parsed file: joints (parents first), frame period [s], one row of channels a frame."""

    path: Path
    joints: list[BvhJoint]
    period: float
    rows: Float[np.ndarray, "t c"]

    def rotation(self, joint: BvhJoint) -> Rotation:
        """Rotations of a joint in all frames."""
        turns = [i for i, c in enumerate(joint.channels) if c in _ROTATIONS]
        if not turns:
            return Rotation.identity(len(self.rows))
        letters = "".join(joint.channels[i][0] for i in turns)
        columns = [joint.first_column + i for i in turns]
        return Rotation.from_euler(letters, self.rows[:, columns], degrees=True)

    def position(self, joint: BvhJoint) -> Float[np.ndarray, "t 3"]:
        """Positions of a joint in its parent, in file units: position channels replace offsets."""
        position = np.tile(joint.offset, (len(self.rows), 1))
        for i, channel in enumerate(joint.channels):
            if channel in _POSITIONS:
                position[:, _POSITIONS.index(channel)] = self.rows[:, joint.first_column + i]
        return position

    def height(self) -> float:
        """Height of the skeleton at zero rotations, in file units."""
        points: list[np.ndarray] = []
        for joint in self.joints:
            start = points[joint.parent] if joint.parent >= 0 else np.zeros(3)
            points.append(start + joint.offset)
        ends = [points[i] + j.end_site for i, j in enumerate(self.joints) if j.end_site is not None]
        return float(np.ptp(np.array(points + ends)[:, 1]))


def body_from_bvh(path: str | os.PathLike[str]) -> Body:
    """Body of a BVH clip: free joint `root` at the first segment, Z up, metres, no limits."""
    return load_bvh(Path(path)).body


def load_bvh(
    path: Path, *, fps: float | None = None, scale: float | None = None, skip: int | None = None
) -> Motion:
    """Load a BVH clip; see `load_motion`."""
    bvh = read_bvh(path)
    inserted = _first_row_is_rest(bvh)
    skipped = int(inserted) if skip is None else skip
    bvh = Bvh(bvh.path, bvh.joints, bvh.period, bvh.rows[skipped:])
    if not len(bvh.rows):
        raise InputError(f"{path}: no frames are left after skipping {skipped}")
    metres = _default_scale(bvh) if scale is None else scale
    rotations = [bvh.rotation(joint) for joint in bvh.joints]
    moving = [i == 0 or _moves(R) for i, R in enumerate(rotations)]
    skeleton = _skeleton(bvh, metres, rotations, moving)
    body = skeleton_body(skeleton, segment_shapes(skeleton))
    root_R = (R_WORLD_FILE * rotations[0]).as_quat(scalar_first=True)
    root_p = R_WORLD_FILE.apply(bvh.position(bvh.joints[0]) * metres)
    tracks = {"root": np.hstack([root_p, root_R])} | {
        bone.name: R.as_quat(scalar_first=True)
        for bone, R, moves in zip(skeleton.bones[1:], rotations[1:], moving[1:], strict=True)
        if moves
    }
    q = assemble_poses(body.topology, tracks)
    rate = 1 / bvh.period if fps is None else fps
    facts: dict[str, str | float | int | bool] = {
        "file": path.name, "frame_rate_hz": rate,
        "frame_rate_from": "file header" if fps is None else "argument",
        "metres_per_unit": metres,
        "metres_per_unit_from": "argument" if scale is not None else _default_scale_reason(bvh),
        "skipped_frames": skipped, "first_row_is_rest_pose": inserted,
        "welded_joints": moving.count(False),
    }  # fmt: skip
    return Motion(path.stem, body, Trajectory(jnp.arange(len(q)) / rate, jnp.asarray(q)), facts)


def _first_row_is_rest(bvh: Bvh) -> bool:
    """Whether the first row was inserted by a converter and is no data.

    So it is when all its rotations are zero, or when its root rotation is exactly zero and some
    joint turns further to the second row than any joint between any later rows (the CMU
    conversions' T-pose has arms and feet adjusted, so not all is zero).
    """
    if len(bvh.rows) < 3:
        return False
    rotations = [bvh.rotation(joint) for joint in bvh.joints]
    if max(R[0].magnitude() for R in rotations) == 0.0:
        return True
    steps = np.array([(R[:-1].inv() * R[1:]).magnitude() for R in rotations])
    return bool(rotations[0][0].magnitude() == 0.0 and steps[:, 0].max() > steps[:, 1:].max())


def _default_scale(bvh: Bvh) -> float:
    return CENTIMETRE if bvh.height() > _TALLEST_IN_CMU_UNITS else CMU_UNIT


def _default_scale_reason(bvh: Bvh) -> str:
    unit = "centimetres" if bvh.height() > _TALLEST_IN_CMU_UNITS else "CMU units"
    return f"guess: rest pose {bvh.height():.0f} units tall, so {unit}"


def _moves(R: Rotation) -> bool:
    return bool((R[0].inv() * R).magnitude().max() > _STILL)


def _skeleton(bvh: Bvh, metres: float, rotations: list[Rotation], moving: list[bool]) -> Skeleton:
    names = unique_xsens_names([joint.name for joint in bvh.joints])
    offsets = [_fixed_offset(bvh, i) * metres for i in range(len(bvh.joints))]
    bones = []
    for i, joint in enumerate(bvh.joints):
        root = joint.parent < 0
        still = R_WORLD_FILE if root else Rotation.identity() if moving[i] else rotations[i][0]
        ball = () if root or not moving[i] else (Joint(names[i]),)
        parent = None if root else names[joint.parent]
        position = np.zeros(3) if root else offsets[i]
        end = _end(bvh, i, offsets, metres)
        bones.append(Bone(names[i], parent, position, still, ball, end))
    return Skeleton(bvh.path.stem, tuple(bones))


def _fixed_offset(bvh: Bvh, index: int) -> Float[np.ndarray, "3"]:
    """Offset of a joint in its parent, refusing one that slides during the clip."""
    joint = bvh.joints[index]
    position = bvh.position(joint)
    if index and np.ptp(position, axis=0).max() > 1e-3 * bvh.height():
        raise InputError(
            f"{bvh.path}: joint '{joint.name}' slides in its parent; only the root may translate"
        )
    return np.median(position, axis=0)


def _end(
    bvh: Bvh, index: int, offsets: list[Float[np.ndarray, "3"]], metres: float
) -> Float[np.ndarray, "3"]:
    """Far end of a segment: its end site, or where its children start.

    Of several children the one in the mid-plane carries on (the neck, not the shoulders); else
    (fingers) the mean counts.
    """
    end_site = bvh.joints[index].end_site
    if end_site is not None:
        return end_site * metres
    children = [offsets[i] for i, joint in enumerate(bvh.joints) if joint.parent == index]
    middle = [c for c in children if abs(c[0]) < 0.2 * float(np.linalg.norm(c)) + 1e-9]
    chosen = middle[:1] if len(children) > 1 and middle else children
    return np.mean(chosen, axis=0) if chosen else np.zeros(3)


def read_bvh(path: Path) -> Bvh:
    """Parse a BVH file.

    Raises:
        InputError: naming the line and the fault.
    """
    lines = read_lines(path)
    if lines[0].words[0].upper() != "HIERARCHY":
        raise lines[0].error("expected HIERARCHY, so this is not a BVH file")
    start = next((i for i, li in enumerate(lines) if li.words[0].upper() == "MOTION"), None)
    if start is None:
        raise InputError(f"{path}: no MOTION section (is the file cut off?)")
    joints = _read_hierarchy(lines[1:start])
    if not joints:
        raise InputError(f"{path}: the hierarchy has no joints")
    count, period = _read_header(path, lines[start + 1 : start + 3])
    columns = sum(len(joint.channels) for joint in joints)
    rows = _read_rows(lines[start + 3 :], columns)
    if len(rows) != count:
        raise InputError(f"{path}: the header says {count} frames, the file holds {len(rows)}")
    return Bvh(path, joints, period, rows)


def _read_hierarchy(lines: list[LineReader]) -> list[BvhJoint]:
    joints: list[BvhJoint] = []
    stack: list[int | None] = []  # open braces: index of the joint, None for an end site
    pending: int | None = None
    columns = 0
    for line in lines:
        key = line.words[0].upper()
        owner = stack[-1] if stack else None
        if key in ("ROOT", "JOINT"):
            parent = -1 if owner is None else owner
            if (key == "ROOT") != (not joints) or len(line.words) < 2:
                raise line.error(f"unexpected {key}; one ROOT and then named JOINTs are supported")
            joints.append(BvhJoint(" ".join(line.words[1:]), parent))
            pending = len(joints) - 1
        elif key == "END":
            pending = None
        elif key == "{":
            stack.append(pending)
        elif key == "}":
            if not stack:
                raise line.error("brace closes nothing")
            stack.pop()
        elif key == "OFFSET" and stack:
            _set_offset(joints, stack, line.floats(1, 3))
        elif key == "CHANNELS" and owner is not None:
            joints[owner].channels = _channels(line)
            joints[owner].first_column = columns
            columns += len(joints[owner].channels)
        else:
            raise line.error(f"'{line.text[:40]}' is not understood here")
    return joints


def _set_offset(joints: list[BvhJoint], stack: list[int | None], offset: np.ndarray) -> None:
    owner = stack[-1]
    if owner is not None:
        joints[owner].offset = offset
        return
    enclosing = next((i for i in reversed(stack) if i is not None), None)
    if enclosing is not None:
        joints[enclosing].end_site = offset


def _channels(line: LineReader) -> tuple[str, ...]:
    channels = tuple(line.words[2:])
    if len(channels) != int(line.floats(1, 1)[0]):
        raise line.error(f"announces {line.words[1]} channels but names {len(channels)}")
    for channel in channels:
        if channel not in _POSITIONS + _ROTATIONS:
            raise line.error(
                f"unknown channel '{channel}'; valid: {', '.join(_POSITIONS + _ROTATIONS)}"
            )
    return channels


def _read_header(path: Path, lines: list[LineReader]) -> tuple[int, float]:
    if len(lines) < 2 or lines[0].words[0] != "Frames:" or lines[1].words[:2] != ["Frame", "Time:"]:
        raise InputError(f"{path}: MOTION must go on with 'Frames:' and 'Frame Time:'")
    period = float(lines[1].floats(2, 1)[0])
    if period <= 0:
        raise lines[1].error("the frame time must be positive")
    return int(lines[0].floats(1, 1)[0]), period


def _read_rows(lines: list[LineReader], columns: int) -> Float[np.ndarray, "t c"]:
    for line in lines:
        if len(line.words) != columns:
            raise line.error(f"needs {columns} values, found {len(line.words)}")
    try:
        rows = np.array([line.words for line in lines], float).reshape(-1, columns)
    except ValueError:
        rows = np.array([[np.nan]])
    if not np.isfinite(rows).all():
        for line in lines:  # find the culprit
            line.numbers(line.words)
    return rows

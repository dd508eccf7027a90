"""Acclaim skeletons (`.asf`) as bodies.

A bone's world rotation is W = W_parent C R C^-1 with C its `axis` frame and R = Rz Ry Rx of its
AMC angles; it runs from its parent's end along its `direction`. Here each bone's frame is W C, so
that R acts in the bone's own axes: three degrees of freedom make one ball joint, one or two make
hinges in the order z, y, x (outer first), none welds the bone to its parent.
"""

from __future__ import annotations

import itertools
import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.motion.segment_names import unique_xsens_names
from mocap_jax.motion.shapes import segment_shapes
from mocap_jax.motion.skeleton import R_WORLD_FILE, Bone, Joint, Skeleton, skeleton_body
from mocap_jax.motion.text_file import LineReader, read_lines

AXES = {"rx": (1.0, 0.0, 0.0), "ry": (0.0, 1.0, 0.0), "rz": (0.0, 0.0, 1.0)}
_INCH = 0.0254
_ROOT_ORDER = ("TX", "TY", "TZ", "RX", "RY", "RZ")
# Beyond this a ball's single limit angle says nothing (its Euler limits reach half a turn).
_LARGEST_BALL_LIMIT = math.radians(170)


@dataclass(frozen=True)
class AsfBone:
    """One `begin ... end` block of `:bonedata`, angles in radians, lengths as in the file."""

    name: str
    direction: np.ndarray
    length: float
    R_file_axis: Rotation
    dofs: tuple[str, ...]
    limits: dict[str, tuple[float, float]]


@dataclass(frozen=True)
class Asf:
    """A parsed skeleton file."""

    path: Path
    bones: dict[str, AsfBone]
    parent: dict[str, str]
    degrees: bool
    metres_per_unit: float
    R_file_root: Rotation

    def names(self) -> dict[str, str]:
        """Segment names by ASF bone name, the root's included."""
        bones = ["root", *self.bones]
        return dict(zip(bones, unique_xsens_names(bones), strict=True))


def body_from_asf(path: str | os.PathLike[str]) -> Body:
    """Body of an Acclaim skeleton: free joint `root` at `Pelvis`, Z up, X forward, metres.

    Hinges are named `<segment>_rx` and so on, ball joints as their segment. Limits are the file's;
    a ball joint's is the largest angle its Euler limits allow, none when that nears half a turn.

    Raises:
        InputError: the file is missing, empty, or a line of it cannot be understood.
    """
    skeleton = asf_skeleton(read_asf(path))
    return skeleton_body(skeleton, segment_shapes(skeleton))


def asf_skeleton(
    asf: Asf,
    *,
    scale: float | None = None,
    ranges: dict[str, tuple[float, float]] | None = None,
) -> Skeleton:
    """Skeleton in metres.

    Args:
        asf: the parsed file.
        scale: metres per file unit, instead of the file's own.
        ranges: limits [rad] by joint name, instead of the file's.
    """
    metres = asf.metres_per_unit if scale is None else scale
    names = asf.names()
    root = Bone(names["root"], None, np.zeros(3), R_WORLD_FILE * asf.R_file_root)
    bones = {"root": root}
    axis = {"root": asf.R_file_root}
    for name in _parents_first(asf):
        bone, parent = asf.bones[name], asf.parent[name]
        axis[name] = bone.R_file_axis
        joints = _joints(names[name], bone, ranges or {})
        bones[name] = Bone(
            names[name],
            names[parent],
            position=bones[parent].end,
            rotation=axis[parent].inv() * bone.R_file_axis,
            joints=joints,
            end=bone.R_file_axis.inv().apply(bone.direction * bone.length * metres),
        )
    return Skeleton(asf.path.stem, tuple(bones.values()))


def _parents_first(asf: Asf) -> list[str]:
    ordered, frontier = [], ["root"]
    while frontier:
        name = frontier.pop(0)
        children = [c for c, p in asf.parent.items() if p == name]
        ordered += children
        frontier = children + frontier
    return ordered


def _joints(
    segment: str, bone: AsfBone, ranges: dict[str, tuple[float, float]]
) -> tuple[Joint, ...]:
    if len(bone.dofs) == 3:
        return (Joint(segment, None, ranges.get(segment, _ball_limit(bone))),)
    return tuple(
        Joint(f"{segment}_{dof}", AXES[dof], ranges.get(f"{segment}_{dof}", bone.limits.get(dof)))
        for dof in ("rz", "ry", "rx")
        if dof in bone.dofs
    )


def _ball_limit(bone: AsfBone) -> tuple[float, float] | None:
    if len(bone.limits) < 3:
        return None
    grid = [np.linspace(*bone.limits[dof], 7) for dof in ("rz", "ry", "rx")]
    largest = Rotation.from_euler("ZYX", list(itertools.product(*grid))).magnitude().max()
    return (0.0, float(largest)) if largest < _LARGEST_BALL_LIMIT else None


def read_asf(path: str | os.PathLike[str]) -> Asf:
    """Parse an Acclaim skeleton file.

    Raises:
        InputError: naming the file, the line and the fault.
    """
    sections = _sections(Path(path))
    units = {line.words[0]: line for line in sections.get("units", []) if len(line.words) == 2}
    degrees = "angle" not in units or not units["angle"].words[1].lower().startswith("rad")
    unit = units["length"].floats(1, 1)[0] if "length" in units else 1.0
    bones = _read_bones(sections["bonedata"], degrees)
    return Asf(
        path=Path(path),
        bones=bones,
        parent=_read_hierarchy(Path(path), sections["hierarchy"], bones),
        degrees=degrees,
        metres_per_unit=float(_INCH / unit),
        R_file_root=_read_root(sections["root"], degrees),
    )


def _sections(path: Path) -> dict[str, list[LineReader]]:
    sections: dict[str, list[LineReader]] = {}
    current: list[LineReader] = []
    for line in read_lines(path):
        if line.words[0].startswith(":"):
            current = sections.setdefault(line.words[0][1:].lower(), [])
        else:
            current.append(line)
    missing = [s for s in ("root", "bonedata", "hierarchy") if s not in sections]
    if missing:
        raise InputError(f"{path}: not an ASF skeleton: no section :{missing[0]}")
    return sections


def _read_root(lines: list[LineReader], degrees: bool) -> Rotation:
    axis, orientation = "XYZ", np.zeros(3)
    for line in lines:
        match line.words[0].lower():
            case "order" if tuple(w.upper() for w in line.words[1:]) != _ROOT_ORDER:
                raise line.error(f"root order must be {' '.join(_ROOT_ORDER)}")
            case "axis":
                axis = line.words[1]
            case "orientation":
                orientation = line.floats(1, 3)
    return _axis_rotation(orientation, axis, degrees)


def _axis_rotation(angles: np.ndarray, order: str, degrees: bool) -> Rotation:
    """Extrinsic rotations in the order of the letters (lower case means extrinsic in scipy)."""
    return Rotation.from_euler(order.lower(), angles, degrees=degrees)


def _read_bones(lines: list[LineReader], degrees: bool) -> dict[str, AsfBone]:
    bones: dict[str, AsfBone] = {}
    block: list[LineReader] = []
    for line in lines:
        match line.words[0].lower():
            case "begin":
                block = []
            case "end":
                bone = _read_bone(block, line, degrees)
                bones[bone.name] = bone
            case _:
                block.append(line)
    return bones


def _read_bone(block: list[LineReader], end: LineReader, degrees: bool) -> AsfBone:
    entries = {line.words[0].lower(): line for line in block}
    for key in ("name", "direction", "length", "axis"):
        if key not in entries:
            raise end.error(f"bone without '{key}'")
    name, axis = entries["name"].words[1], entries["axis"]
    dofs = tuple(w.lower() for w in entries["dof"].words[1:]) if "dof" in entries else ()
    for dof in dofs:
        if dof not in AXES:
            raise entries["dof"].error(
                f"degree of freedom '{dof}' of bone '{name}' not supported; valid: rx, ry, rz"
            )
    order = axis.words[4] if len(axis.words) > 4 else "XYZ"
    return AsfBone(
        name=name,
        direction=entries["direction"].floats(1, 3),
        length=float(entries["length"].floats(1, 1)[0]),
        R_file_axis=_axis_rotation(axis.floats(1, 3), order, degrees),
        dofs=dofs,
        limits=_read_limits(block, dofs, degrees),
    )


def _read_limits(
    block: list[LineReader], dofs: tuple[str, ...], degrees: bool
) -> dict[str, tuple[float, float]]:
    """Limits [rad] in the order of the degrees of freedom, one line each, in parentheses."""
    starts = [i for i, line in enumerate(block) if line.words[0].lower() == "limits"]
    if not starts:
        return {}
    words = [
        word
        for line in block[starts[0] : starts[0] + len(dofs)]
        for word in line.text.replace("limits", "").replace("(", " ").replace(")", " ").split()
    ]
    line = block[starts[0]]
    if len(words) != 2 * len(dofs):
        raise line.error(f"{len(words)} limit values for {len(dofs)} degrees of freedom")
    values = line.numbers(words).reshape(-1, 2) * (math.pi / 180 if degrees else 1.0)
    return {dof: (float(lo), float(hi)) for dof, (lo, hi) in zip(dofs, values, strict=True)}


def _read_hierarchy(
    path: Path, lines: list[LineReader], bones: dict[str, AsfBone]
) -> dict[str, str]:
    parent: dict[str, str] = {}
    for line in lines:
        first, *children = line.words
        if first.lower() in ("begin", "end"):
            continue
        for name in (first, *children):
            if name != "root" and name not in bones:
                raise line.error(str(unknown_name("bone", name, bones)))
        for child in children:
            parent[child] = first
    loose = [b for b in bones if b not in parent]
    if loose:
        raise InputError(f"{path}: bone '{loose[0]}' is not in the :hierarchy")
    return parent

"""`load_skeleton`: a body from the joint positions of somebody's own skeleton."""

from __future__ import annotations

import os
from itertools import permutations
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.motion.joint_names import SMPL_JOINTS, SMPL_PARENTS, segment_names
from mocap_jax.motion.joint_table import UNITS, JointTable, read_joint_table
from mocap_jax.motion.shapes import segment_shapes
from mocap_jax.motion.skeleton import Bone, Joint, Skeleton, skeleton_body

_NEEDED = ("Pelvis", "LeftUpperLeg", "RightUpperLeg")
_TOPS = ("Head", "Neck", "T8", "T12")
# Extent of a person's joints [m]: a child's and a giant's.
_SMALLEST, _LARGEST = 0.4, 2.6
# Length of what follows the last joint, as a share of the extent of all joints.
_TIP = {"Head": 0.12, "Hand": 0.11, "Fingers": 0.05, "Foot": 0.12, "Toe": 0.045}
_LEAST_UPRIGHT = 0.8


def load_skeleton(path: str | os.PathLike[str], *, unit: str | None = None) -> Body:
    """A body from a file of joints: names, parents and positions in a rest pose.

    Every joint but the root becomes a ball joint, the root a free one; capsules are laid along the
    segments. At `qpos0` the body stands in the file's rest pose on z = 0, facing X, and all segment
    frames are parallel to the world's.

    Files: JSON (an object) or NPZ with `joints`, `parents`, `positions` and, if you like, `unit`
    (m, cm or mm; default m); or CSV with the columns joint, parent, x, y, z, in metres. `J` and
    `kintree_table` of a body model's own file are understood as positions and parents. Parents are
    names or numbers of joints (from 0), empty, null or -1 for the root.

    Joints are known by SMPL's names (`left_hip`) or numbers, or by names of the segments that they
    start (Xsens', CMU's, a BVH's); 24 joints without names are SMPL's in its order, and SMPL's 24
    need no parents. SMPL's joints become the Xsens segments Pelvis, UpperLeg (hip), LowerLeg
    (knee), Foot (ankle), Toe (foot), L5, T12, T8 (spine1 to 3), Neck, Head, Shoulder (collar),
    UpperArm (shoulder), ForeArm (elbow), Hand (wrist) and Fingers (hand); others keep their names.

    Axes may be any right-handed ones that the person stands along: left is found from the hips,
    up from the trunk.

    Args:
        path: `.json`, `.npz` or `.csv`.
        unit: m, cm or mm, whatever the file says.

    Raises:
        InputError: naming the file and the fault.
    """
    table = read_joint_table(Path(path))
    if unit is not None and unit not in UNITS:
        raise unknown_name("unit", unit, UNITS)
    names, parents = _tree(table)
    places = table.positions * UNITS[unit or table.unit]
    _check_size(table.path, places)
    places = places @ _upright(table.path, dict(zip(names, places, strict=True))).T
    skeleton = _skeleton(table.path.stem, names, parents, places)
    return skeleton_body(skeleton, segment_shapes(skeleton))


def _tree(table: JointTable) -> tuple[list[str], list[int]]:
    """Segment names and numbers of parents (-1: root)."""
    joints = _joints(table)
    if table.parents is not None:
        parents = [_parent(table, joints, k) for k in range(len(joints))]
    elif sorted(joints) == sorted(SMPL_JOINTS):
        order = [joints.index(name) for name in SMPL_JOINTS]
        parents = [-1] * len(joints)
        for child, parent in zip(order, SMPL_PARENTS, strict=True):
            parents[child] = -1 if parent < 0 else order[parent]
    else:
        raise InputError(f"{table.path}: no 'parents' (only SMPL's 24 joints need none)")
    _check_tree(table, joints, parents)
    names = segment_names(tuple(joints))
    missing = [n for n in _NEEDED if n not in names]
    if missing or not any(n in names for n in _TOPS):
        raise InputError(
            f"{table.path}: no joint for {missing[0] if missing else 'head, neck or chest'}; "
            f"joints are {', '.join(joints)} (known: SMPL's names such as left_hip, and segments' "
            "such as LeftUpperLeg)"
        )
    return names, parents


def _joints(table: JointTable) -> list[str]:
    """Names of the joints; numbers and nothing stand for SMPL's."""
    names, count = table.names, len(table.positions)
    if names is None:
        if count != len(SMPL_JOINTS):
            raise InputError(
                f"{table.path}: {count} positions without 'joints'; only SMPL's 24 need no names"
            )
        return list(SMPL_JOINTS)
    if all(n.isdigit() for n in names):
        if beyond := [n for n in names if int(n) >= len(SMPL_JOINTS)]:
            raise InputError(
                f"{table.path}: joint {beyond[0]} is none of SMPL's 0 to {len(SMPL_JOINTS) - 1}"
            )
        names = tuple(SMPL_JOINTS[int(n)] for n in names)
    if "" in names:
        raise InputError(f"{table.path}: joint {names.index('')} has no name")
    if twice := [n for n in names if names.count(n) > 1]:
        raise InputError(f"{table.path}: joint '{twice[0]}' is there {names.count(twice[0])} times")
    return list(names)


def _parent(table: JointTable, joints: list[str], k: int) -> int:
    """Number of a joint's parent in the table, -1 for the root."""
    assert table.parents is not None
    text, written = table.parents[k], list(table.names or joints)
    if not text:
        return -1
    if text in written:
        return written.index(text)
    if text in joints:
        return joints.index(text)
    if text.isdigit() and int(text) < len(joints):
        return int(text)
    raise InputError(
        f"{table.path}: parent of '{joints[k]}': {unknown_name('joint', text, joints)}"
    )


def _check_tree(table: JointTable, joints: list[str], parents: list[int]) -> None:
    roots = [joints[k] for k, p in enumerate(parents) if p < 0]
    if len(roots) != 1:
        raise InputError(
            f"{table.path}: {len(roots)} joints without parent"
            + (f" ({', '.join(roots)})" if roots else "")
            + "; one root is needed"
        )
    for k in range(len(joints)):
        at, steps = k, 0
        while at >= 0 and steps <= len(joints):
            at, steps = parents[at], steps + 1
        if at >= 0:
            raise InputError(f"{table.path}: joint '{joints[k]}' is among its own ancestors")


def _check_size(path: Path, places: Float[np.ndarray, "n 3"]) -> None:
    size = float(np.ptp(places, axis=0).max())
    if _SMALLEST <= size <= _LARGEST:
        return
    fits = [u for u, metres in UNITS.items() if _SMALLEST <= size * metres <= _LARGEST]
    hint = f"; in {fits[0]}? say unit='{fits[0]}'" if fits else ""
    raise InputError(
        f"{path}: joints extend over {size:.4g} m, expected {_SMALLEST} to {_LARGEST} m{hint}"
    )


def _upright(path: Path, place: dict[str, np.ndarray]) -> Float[np.ndarray, "3 3"]:
    """Rotation from the file's axes to X forward, Y left, Z up: the nearest exchange of axes."""
    hips = place["LeftUpperLeg"], place["RightUpperLeg"]
    top = next(place[n] for n in _TOPS if n in place)
    left, up = hips[0] - hips[1], top - (hips[0] + hips[1]) / 2
    if min(np.linalg.norm(left), np.linalg.norm(up)) < 1e-3:
        raise InputError(f"{path}: both hips, or hips and trunk, are in one place")
    left, up = left / np.linalg.norm(left), up / np.linalg.norm(up)
    wanted = np.stack([np.cross(left, up), left, up])
    R = max(_axis_exchanges(), key=lambda M: float((M * wanted).sum()))
    if min(R[1] @ left, R[2] @ up) < _LEAST_UPRIGHT:
        raise InputError(
            f"{path}: the person does not stand along the axes (hips along {_words(left)}, trunk "
            f"along {_words(up)}); turn the rest pose upright"
        )
    for side in ("Left", "Right"):
        if side + "Foot" in place and side + "Toe" in place:
            toes = R @ (place[side + "Toe"] - place[side + "Foot"])
            if toes[0] < 0:
                raise InputError(
                    f"{path}: feet point backwards: left and right are exchanged, or the axes are "
                    "left-handed"
                )
    return R


def _axis_exchanges() -> list[Float[np.ndarray, "3 3"]]:
    """The 24 rotations that take axes to axes."""
    signs = np.stack(np.meshgrid(*[(1.0, -1.0)] * 3), axis=-1).reshape(-1, 3)
    all_of_them = [np.eye(3)[list(p)] * s for p in permutations(range(3)) for s in signs]
    return [M for M in all_of_them if np.linalg.det(M) > 0]


def _words(direction: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.2f}" for x in direction) + ")"


def _skeleton(
    name: str, names: list[str], parents: list[int], places: Float[np.ndarray, "n 3"]
) -> Skeleton:
    """Bones from joint to joint, parents first."""
    bones: list[Bone] = []
    waiting = [parents.index(-1)]
    size = float(np.ptp(places[:, 2]))
    while waiting:
        k = waiting.pop(0)
        children = [c for c, p in enumerate(parents) if p == k]
        root = parents[k] < 0
        start = np.zeros(3) if root else places[parents[k]]
        end = _following(places[k], places[children]) if children else None
        if end is None:
            end = _tip(names[k], places[k] - start, size)
        bones.append(
            Bone(
                names[k], None if root else names[parents[k]],
                np.zeros(3) if root else places[k] - start, Rotation.identity(),
                () if root else (Joint(names[k]),), end, tip=None if children else end,
            )
        )  # fmt: skip
        waiting += children
    return Skeleton(name, tuple(bones))


def _following(start: np.ndarray, ends: Float[np.ndarray, "n 3"]) -> np.ndarray:
    """Where a segment ends: at the next joint, of several at one in the mid-plane."""
    offsets = ends - start
    middle = [o for o in offsets if abs(o[1]) < 0.2 * float(np.linalg.norm(o)) + 1e-9]
    return middle[0] if len(offsets) > 1 and middle else offsets.mean(axis=0)


def _tip(name: str, along: np.ndarray, size: float) -> np.ndarray:
    """End of a segment that no joint follows: straight on, feet forward."""
    part = name.removeprefix("Left").removeprefix("Right")
    length = _TIP.get(part, 0.03) * size
    if part in ("Foot", "Toe"):
        return np.array([length, 0.0, 0.0])
    norm = float(np.linalg.norm(along))
    return length * (along / norm if norm > 1e-6 else np.array([0.0, 0.0, 1.0]))

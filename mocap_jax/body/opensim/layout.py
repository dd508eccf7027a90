"""One OpenSim joint as an MJCF body frame with slides and hinges.

The transform of a joint is R = R1 R2 R3 about its axes and a shift. With theta_i0 the turns in the
default pose and x_i what is added to them, R = (R1 R2 R3)_0 X1 X2 X3, where X_i turns by x_i about
the axis i as the later constant turns leave it. So the axes become consecutive hinges, exactly.
A shift that follows a turn (the rolling of a knee) becomes a pivot instead: the point (a, c) fixed
to both sides for which a - R(q) c is nearest to the shift over the range of motion.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body.coupling import Coupling
from mocap_jax.body.opensim.coordinates import Known
from mocap_jax.body.opensim.model import OsimJoint, TransformAxis
from mocap_jax.errors import InputError

# Poses over the range of motion at which a pivot is fitted, for each coordinate it depends on.
_SAMPLES = {1: 241, 2: 31, 3: 11}


@dataclass(frozen=True)
class Axis:
    """One hinge or slide of an MJCF body."""

    name: str
    kind: str
    """`hinge` or `slide`."""
    axis: np.ndarray
    """In the child body's frame."""
    reference: float
    """Its coordinate in the default pose [rad, m]."""
    range: tuple[float, float] | None


@dataclass(frozen=True)
class Layout:
    """Where the child body stands in its parent in the default pose, and how it moves."""

    rotation: Rotation
    """`R_parent_child`."""
    position: np.ndarray
    """[m]"""
    anchor: np.ndarray
    """Pivot of the hinges in the child body [m]."""
    axes: tuple[Axis, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    pivot_error: tuple[float, float] | None = None
    """Largest and root-mean-square distance from OpenSim's shift [m], where a pivot stands for it.
    """


@dataclass
class _Work:
    """The parts of a layout while they are gathered."""

    axes: list[Axis] = field(default_factory=list)
    couplings: list[Coupling] = field(default_factory=list)


def leading_axis(joint: OsimJoint, coordinate: str) -> TransformAxis | None:
    """The first axis that the coordinate itself measures: a straight line of slope 1 or -1."""
    for axis in (*joint.rotations, *joint.translations):
        line = axis.function.line
        if axis.coordinate == coordinate and line and abs(abs(line[1]) - 1.0) < 1e-12:
            return axis
    return None


def joint_layout(joint: OsimJoint, known: dict[str, Known], where: str) -> Layout:
    """Lay a joint out as slides and hinges.

    Raises:
        InputError: a coordinate that no axis measures directly.
    """
    moving = [c.name for c in joint.coordinates if not known[c.name].fixed]
    leaders = {name: leading_axis(joint, name) for name in moving}
    for name, axis in leaders.items():
        if axis is None:
            raise InputError(
                f"{where}: coordinate '{name}' moves no axis one to one (a LinearFunction of slope "
                "1 or -1), which the kinematics needs"
            )
    default = {c.name: known[c.name].default for c in joint.coordinates}
    turned = Rotation.concatenate(
        [Rotation.from_rotvec(a.axis * _value(a, default)) for a in joint.rotations]
        or [Rotation.identity()]
    )
    R_joint = Rotation.identity()
    for turn in turned:
        R_joint = R_joint * turn
    Rp, Rc = joint.parent.rotation, joint.child.rotation
    rotation = Rp * R_joint * Rc.inv()
    work = _Work()
    rolling = _add_slides(joint, known, leaders, rotation, default, work)
    _add_hinges(joint, known, leaders, turned, default, work)
    a, c, error = _pivot(joint, rolling, known) if rolling else (np.zeros(3), np.zeros(3), None)
    shift = a - R_joint.apply(c)
    for axis in joint.translations:
        if axis not in rolling:
            shift = shift + axis.axis * _value(axis, default)
    shift = shift - R_joint.apply(Rc.inv().apply(joint.child.position))
    return Layout(
        rotation,
        joint.parent.position + Rp.apply(shift),
        joint.child.position + Rc.apply(c),
        tuple(work.axes),
        tuple(work.couplings),
        error,
    )


def welded_layout(joint: OsimJoint, known: dict[str, Known]) -> Layout:
    """The joint held in its default pose."""
    default = {c.name: known[c.name].default for c in joint.coordinates}
    R, t = joint_transform(joint, default)
    Rp, Rc = joint.parent.rotation, joint.child.rotation
    rotation = Rp * R * Rc.inv()
    shift = t - R.apply(Rc.inv().apply(joint.child.position))
    return Layout(rotation, joint.parent.position + Rp.apply(shift), joint.child.position)


def joint_transform(joint: OsimJoint, q: dict[str, float]) -> tuple[Rotation, np.ndarray]:
    """OpenSim's transform of a joint: child frame in parent frame."""
    R = Rotation.identity()
    for axis in joint.rotations:
        R = R * Rotation.from_rotvec(axis.axis * _value(axis, q))
    return R, sum((a.axis * _value(a, q) for a in joint.translations), np.zeros(3))


def _value(axis: TransformAxis, q: dict[str, float]) -> float:
    return float(axis.function(np.asarray(q[axis.coordinate] if axis.coordinate else 0.0)))


def _moves(axis: TransformAxis, known: dict[str, Known]) -> bool:
    """Whether the axis moves at all."""
    line = axis.function.line
    constant = line is not None and line[1] == 0.0
    return axis.coordinate is not None and not known[axis.coordinate].fixed and not constant


def _add_slides(
    joint: OsimJoint, known: dict[str, Known], leaders: dict[str, TransformAxis | None],
    R_parent_child: Rotation, default: dict[str, float], work: _Work,
) -> list[TransformAxis]:  # fmt: skip
    """Add the slides; return the shifts that follow turns, for which a pivot must do."""
    rolling = []
    for axis in joint.translations:
        if not _moves(axis, known):
            continue
        leader = leaders[axis.coordinate or ""]
        if leader in joint.rotations:
            rolling.append(axis)
            continue
        in_child = R_parent_child.inv().apply(joint.parent.rotation.apply(axis.axis))
        _add(joint, axis, "slide", in_child, known, leader, default, work)
    return rolling


def _add_hinges(
    joint: OsimJoint, known: dict[str, Known], leaders: dict[str, TransformAxis | None],
    turned: Rotation, default: dict[str, float], work: _Work,
) -> None:  # fmt: skip
    for i, axis in enumerate(joint.rotations):
        if not _moves(axis, known):
            continue
        later = Rotation.identity()
        for turn in list(turned)[i + 1 :]:
            later = later * turn
        in_child = joint.child.rotation.apply(later.inv().apply(axis.axis))
        leader = leaders[axis.coordinate or ""]
        _add(joint, axis, "hinge", in_child, known, leader, default, work)


def _add(
    joint: OsimJoint, axis: TransformAxis, kind: str, direction: np.ndarray,
    known: dict[str, Known], leader: TransformAxis | None, default: dict[str, float], work: _Work,
) -> None:  # fmt: skip
    name = axis.coordinate or ""
    coordinate = known[name]
    if axis is leader:
        line = axis.function.line
        sign = 1.0 if line is None or line[1] > 0 else -1.0
        work.axes.append(Axis(name, kind, sign * direction, default[name], coordinate.limits))
        if coordinate.follows:
            work.couplings.append(Coupling(name, *coordinate.follows))
        return
    own = f"{joint.name}/{axis.name}"
    values = axis.function(np.linspace(*coordinate.coordinate.range, 501))
    limits = (float(values.min()), float(values.max())) if coordinate.limits else None
    # A range of no width is none to MuJoCo.
    limits = limits if limits and limits[1] - limits[0] > 1e-9 else None
    work.axes.append(Axis(own, kind, direction, _value(axis, default), limits))
    work.couplings.append(Coupling(own, name, axis.function))


def _pivot(
    joint: OsimJoint, rolling: list[TransformAxis], known: dict[str, Known]
) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    """Points (a on the parent's, c on the child's side) that stand for shifts that follow turns."""
    used = list(
        dict.fromkeys(
            a.coordinate for a in (*joint.rotations, *rolling) if a.coordinate and _moves(a, known)
        )
    )
    grids = [np.linspace(*known[name].coordinate.range, _SAMPLES[len(used)]) for name in used]
    rows, shifts = [], []
    rest = {c.name: known[c.name].default for c in joint.coordinates}
    for values in zip(*(g.ravel() for g in np.meshgrid(*grids)), strict=True):
        q = rest | {name: float(v) for name, v in zip(used, values, strict=True)}
        R, _ = joint_transform(joint, q)
        rows.append(np.hstack([np.eye(3), -R.as_matrix()]))
        shifts.append(sum((a.axis * _value(a, q) for a in rolling), np.zeros(3)))
    matrix, target = np.concatenate(rows), np.concatenate(shifts)
    solution = np.linalg.lstsq(matrix, target, rcond=1e-9)[0]
    miss = np.linalg.norm((matrix @ solution - target).reshape(-1, 3), axis=1)
    error = (float(miss.max()), float(np.sqrt((miss**2).mean())))
    return solution[:3], solution[3:], error

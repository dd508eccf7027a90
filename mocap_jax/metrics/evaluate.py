"""`evaluate`: errors of an estimate against the truth or another estimate."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.metrics.align import Aligned, align, common_segments
from mocap_jax.metrics.error_table import ErrorTable
from mocap_jax.metrics.joint_centres import joint_centres
from mocap_jax.metrics.observed import observed_segments
from mocap_jax.metrics.rotation_angle import rotation_angle
from mocap_jax.metrics.sparse_poser import sparse_poser_errors
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution
from mocap_jax.solution.anatomy import JointAngle, joint_angle_list
from mocap_jax.solution.angles import (
    anatomical_rotations,
    hinge_coordinate,
    joint_rotations,
)
from mocap_jax.solution.cardan import cardan_zxy, locked, nearest_solution, wrap
from mocap_jax.solution.poses import joint_segments, root_segment, segment_poses

TABLE1_SEGMENTS = ("Head", "RightUpperArm", "LeftUpperLeg")
"""Neck, right shoulder and left hip of Vlasic 2007, table 1."""

# Cardan angles mean nothing where the middle one of the truth is this close to a quarter turn.
_LOCK = np.deg2rad(10.0)


def evaluate(
    solution: Solution, reference: Recording | Solution, *, from_time: float | None = None
) -> ErrorTable:
    """Compare an estimate with the truth of a recording, or with another estimate.

    The reference is interpolated at the solution's times (along geodesics); segments are matched
    by name, so segment lengths and sensor mounting may differ. Metrics, each by joint and in the
    mean (see `ErrorTable`):

    - `orientation_error_mean_deg`, `orientation_error_rmse_deg`: angle (0 to 180) between the
      estimated and true rotation of each joint, child in parent. `mean` is over all joints,
      `mean_observed` over those the sensors observe, `mean_table1` over head, right upper arm and
      left thigh relative to the root segment. Aggregates of the RMSE are means of the joints'.
    - `root_relative_orientation_error_mean_deg`, `..._std_deg`: those three joints (mean and
      standard deviation over time, as in Vlasic 2007, table 1).
    - `segment_orientation_error_mean_deg`: of segments in the world frame.
    - `position_error_mean_cm`: of joint centres, after subtracting the root's position only.
    - `validation_orientation_error_..._deg`, `marker_position_error_..._cm`: those of the Sparse
      Inertial Poser (`metrics.sparse_poser`), for bodies with thighs, upper arms and so on.
    - `joint_angle_rmse_deg`: of the angles of `solution.angles.joint_angles`. Differences are
      taken on the circle and between the nearer Cardan solutions; frames in which the true middle
      angle is within 10 degrees of gimbal lock are left out.

    Args:
        solution: the estimate.
        reference: a recording that holds its truth, or another solution.
        from_time: first time scored [s]; default `solution.setup.score_from`.

    Raises:
        InputError: no truth, or nothing in common to compare.
    """
    pair = align(solution, reference, from_time)
    topology = pair.body.topology
    joints = common_segments(topology, pair.reference_body.topology, joint_segments(topology))
    if not joints:
        raise InputError(
            "the bodies of solution and reference have no joint in common (segments are matched "
            f"by name; the solution's are {', '.join(topology.body_names[1:])})"
        )
    R, p = segment_poses(pair.body, pair.q)
    R_true, p_true = segment_poses(pair.reference_body, pair.reference_q)
    observed = _observed(solution)
    table1 = _table1(pair)
    mine, other = np.array(joints).T
    names = [topology.body_names[b] for b in mine]
    errors = _orientation_errors(pair, R, R_true, mine, other, names, observed, table1)
    errors["segment_orientation_error_mean_deg"] = _segment_errors(pair, R, R_true, observed)
    distance = _position_errors(pair, (R, p), (R_true, p_true), mine, other)
    errors["position_error_mean_cm"] = _summary(names, 100 * distance.mean(axis=0), observed)
    errors |= sparse_poser_errors(pair, (R, p), (R_true, p_true))
    errors["joint_angle_rmse_deg"] = _angle_errors(pair, R, R_true, observed)
    return ErrorTable(
        errors,
        tuple(n for n in names if n in observed),
        table1,
        len(pair.time),
        (float(pair.time[0]), float(pair.time[-1])),
        topology.body_names[root_segment(topology)],
    )


def _observed(solution: Solution) -> tuple[str, ...]:
    if solution.observed:
        return solution.observed
    known = set(solution.body.topology.site_names)
    return observed_segments(
        solution.body, [s.site for s in solution.setup.sensors if s.site in known]
    )


def _table1(pair: Aligned) -> tuple[str, ...]:
    shared = set(pair.body.topology.body_names) & set(pair.reference_body.topology.body_names)
    return tuple(n for n in TABLE1_SEGMENTS if n in shared)


def _summary(names: list[str], values: np.ndarray, observed: tuple[str, ...]) -> dict[str, float]:
    """Values by name and their means over all and over the observed joints."""
    out = {name: float(v) for name, v in zip(names, values, strict=True)}
    out["mean"] = float(np.mean(values))
    # Of an angle (`<segment>/<angle>`) the segment counts; of several people theirs have a / too.
    seen = [
        v for name, v in zip(names, values, strict=True)
        if name in observed or name.rpartition("/")[0] in observed
    ]  # fmt: skip
    if seen:
        out["mean_observed"] = float(np.mean(seen))
    return out


def _orientation_errors(
    pair: Aligned,
    R: np.ndarray,
    R_true: np.ndarray,
    mine: np.ndarray,
    other: np.ndarray,
    names: list[str],
    observed: tuple[str, ...],
    table1: tuple[str, ...],
) -> dict[str, dict[str, float]]:
    """The metrics of joint rotations, and those of table 1."""
    joint = joint_rotations(pair.body, R)[:, mine]
    joint_true = joint_rotations(pair.reference_body, R_true)[:, other]
    angle = np.rad2deg(rotation_angle(joint, joint_true))
    mean = _summary(names, angle.mean(axis=0), observed)
    rmse = _summary(names, np.sqrt((angle**2).mean(axis=0)), observed)
    errors = {"orientation_error_mean_deg": mean, "orientation_error_rmse_deg": rmse}
    if table1:
        relative = np.rad2deg(_root_relative_angles(pair, R, R_true, table1))
        mean["mean_table1"] = float(relative.mean())
        rmse["mean_table1"] = float(np.sqrt((relative**2).mean(axis=0)).mean())
        for key, values in (("mean", relative.mean(axis=0)), ("std", relative.std(axis=0))):
            errors[f"root_relative_orientation_error_{key}_deg"] = _summary(
                list(table1), values, ()
            )
    return errors


def _root_relative_angles(
    pair: Aligned, R: np.ndarray, R_true: np.ndarray, segments: tuple[str, ...]
) -> Float[np.ndarray, "t n"]:
    """Error angle [rad] of segments' rotation relative to the root segment."""

    def relative(body: Body, rotation: np.ndarray) -> np.ndarray:
        chosen = [body.topology.body_index(n) for n in segments]
        root = rotation[:, [root_segment(body.topology)]]
        return np.swapaxes(root, -1, -2) @ rotation[:, chosen]

    return rotation_angle(relative(pair.body, R), relative(pair.reference_body, R_true))


def _segment_errors(
    pair: Aligned, R: np.ndarray, R_true: np.ndarray, observed: tuple[str, ...]
) -> dict[str, float]:
    """Errors in the world frame of all segments that move (welded ones repeat their parent)."""
    topology = pair.body.topology
    moving = sorted(set(topology.joint_body))
    mine, other = np.array(common_segments(topology, pair.reference_body.topology, moving)).T
    angle = np.rad2deg(rotation_angle(R[:, mine], R_true[:, other]))
    return _summary([topology.body_names[b] for b in mine], angle.mean(axis=0), observed)


def _position_errors(
    pair: Aligned,
    poses: tuple[np.ndarray, np.ndarray],
    poses_true: tuple[np.ndarray, np.ndarray],
    mine: np.ndarray,
    other: np.ndarray,
) -> Float[np.ndarray, "t n"]:
    """Distance [m] of joint centres, both relative to the position of their root."""
    sides = []
    for body, (R, p), chosen in (
        (pair.body, poses, mine), (pair.reference_body, poses_true, other),
    ):  # fmt: skip
        centre = joint_centres(body, R, p)[:, chosen]
        sides.append(centre - p[:, [root_segment(body.topology)]])
    return np.linalg.norm(sides[0] - sides[1], axis=-1)


def _angle_errors(
    pair: Aligned, R: np.ndarray, R_true: np.ndarray, observed: tuple[str, ...]
) -> dict[str, float]:
    """RMSE [deg] of every named joint angle (same structure of joints only)."""
    if not pair.same_structure:
        return {}
    body = pair.reference_body
    # Both through the reference's anatomical frames: a longer shin is not an angle error.
    both = [anatomical_rotations(body, joint_rotations(body, r)) for r in (R, R_true)]
    listed = joint_angle_list(body)
    values = np.array([np.rad2deg(_angle_rmse(pair, angle, *both)) for angle in listed])
    return _summary([a.name for a in listed], values, observed) if len(listed) else {}


def _angle_rmse(pair: Aligned, angle: JointAngle, A: np.ndarray, A_true: np.ndarray) -> float:
    b = angle.segment
    if angle.axis < 0:
        error = wrap(
            hinge_coordinate(pair.body, pair.q, b)
            - hinge_coordinate(pair.reference_body, pair.reference_q, b)
        )
        return float(np.sqrt((error**2).mean()))
    true = cardan_zxy(A_true[:, b])
    error = (nearest_solution(cardan_zxy(A[:, b]), true) - true)[:, angle.axis]
    usable = ~locked(true, _LOCK)
    # A joint that never leaves the lock is scored all the same: no figure would hide it.
    chosen = error[usable] if usable.any() else error
    return float(np.sqrt((chosen**2).mean()))

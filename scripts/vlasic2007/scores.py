"""Figures of one estimate: errors of table 1, of the observed joints, and their prediction."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

import mocap_jax as mj
from mocap_jax.errors import InputError
from mocap_jax.metrics import joint_consistency, unfolded_angles
from mocap_jax.metrics.align import align
from mocap_jax.metrics.rotation_angle import rotation_angle
from mocap_jax.solution.poses import root_segment, segment_poses
from vlasic2007.paper import JOINTS


def scores_of(solution: mj.Solution, recording: mj.Recording) -> dict:
    """All that the tables need of one estimate, as plain numbers."""
    scores: dict = {
        "status": solution.status.name, "remarks": solution.remarks,
        "frames": len(solution.trajectory.time), "iterations": solution.iterations,
        "seconds_solve": solution.seconds_solve, "seconds_compile": solution.seconds_compile,
    }  # fmt: skip
    if not solution.status.ok:
        return scores
    table = mj.evaluate(solution, recording)
    for key in ("orientation_error_mean_deg", "orientation_error_rmse_deg"):
        scores[key] = {k: v for k, v in table[key].items() if k.startswith("mean")}
    return scores | {"table1": table1(solution, recording)} | _consistency(solution, recording)


def table1(solution: mj.Solution, recording: mj.Recording) -> dict[str, dict[str, list[float]]]:
    """Count, sum and sum of squares over time [deg] of both angles, by joint."""
    R, scored = root_relative_errors(solution, recording)
    folded = rotation_angle(R, np.broadcast_to(np.eye(3), R.shape))
    out = {}
    for i, joint in enumerate(JOINTS):
        pair = {"folded": folded[:, i], "unfolded": unfolded_angles(R[:, i])}
        out[joint] = {k: _moments(np.rad2deg(angle[scored])) for k, angle in pair.items()}
    return out


def root_relative_errors(
    solution: mj.Solution, recording: mj.Recording
) -> tuple[np.ndarray, np.ndarray]:
    """R_estimate_true (t, 3 joints, 3, 3) relative to the root segment, and which frames score.

    From the recording's first frame on, where estimate and truth agree, so that turns can be
    followed.
    """
    pair = align(solution, recording, from_time=-math.inf)
    estimate = root_relative(pair.body, pair.q)
    true = root_relative(pair.reference_body, pair.reference_q)
    scored = pair.time >= solution.setup.score_from - 1e-9
    return np.swapaxes(estimate, -1, -2) @ true, scored


def root_relative(body: mj.Body, q: np.ndarray) -> np.ndarray:
    """Rotations R_root_segment (t, 3 joints, 3, 3) of the joints of table 1."""
    R, _ = segment_poses(body, q)
    chosen = [body.topology.body_index(segment) for segment in JOINTS.values()]
    root = R[:, [root_segment(body.topology)]]
    return np.swapaxes(root, -1, -2) @ R[:, chosen]


def _moments(values: np.ndarray) -> list[float]:
    return [len(values), float(values.sum()), float((values**2).sum())]


def _consistency(solution: mj.Solution, recording: mj.Recording) -> dict:
    try:
        found = joint_consistency(solution, recording)
    except InputError:  # No covariance: the data do not determine every pose.
        return {}
    return {"consistency": dataclasses.asdict(found)}

"""Figure 7 of the paper: does the left shoulder drift in treadmill walking without distances?"""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

SEGMENT = "LeftUpperArm"
COMBINATIONS = ("A+G+D", "A+G")
METHODS = ("ekf", "ekf_paper")
# The built-in walking repeats itself exactly after five strides of 1.06 s, at its 120 frames/s.
_PERIOD = 636


@dataclass(frozen=True)
class Shoulder:
    """Left upper arm relative to the pelvis over time, estimated and true."""

    time: np.ndarray
    """(t,) [s]."""
    names: tuple[str, ...]
    """Of the angles."""
    angles: np.ndarray
    """(t, 3) estimated Z-X-Y angles [deg]."""
    true_angles: np.ndarray
    """(t, 3) [deg]."""
    error: np.ndarray
    """(t, 3) rotation vector of the error in the pelvis' frame, its Z up [deg]."""
    q: np.ndarray
    """(t, nq) estimated poses."""
    true_q: np.ndarray
    """(t, nq) true poses."""

    @property
    def error_angle(self) -> np.ndarray:
        """(t,) angle of the error [deg]."""
        return np.linalg.norm(self.error, axis=1)

    def between(self, start: float, end: float) -> np.ndarray:
        """Mask of the frames between two times [s] after the first one."""
        since = self.time - self.time[0]
        return (since >= start) & (since <= end)

    def drift(self, start: float = 0.0, end: float = np.inf) -> float:
        """Slope of a straight line through the turn about the pelvis' vertical [deg/min]."""
        chosen = self.between(start, end)
        return 60 * float(np.polyfit(self.time[chosen], self.error[chosen, 2], 1)[0])

    def mean_error(self, start: float = 0.0, end: float = np.inf) -> float:
        """Mean angle of the error [deg]."""
        return float(self.error_angle[self.between(start, end)].mean())


def walking_in_place(seconds: float) -> Any:
    """The built-in walking as on a treadmill: strides repeat, the pelvis stays in place."""
    import mocap_jax as mj

    motion = mj.builtin_motion("walking")
    time, q = np.asarray(motion.trajectory.time), np.asarray(motion.trajectory.q)
    step = time[1] - time[0]
    speed = (q[_PERIOD, 0] - q[0, 0]) / (_PERIOD * step)
    in_place = np.array(q)
    in_place[:, 0] -= speed * time
    if not np.allclose(in_place[0], in_place[_PERIOD], atol=1e-6):
        raise AssertionError("the built-in walking no longer repeats itself after five strides")
    frames = np.arange(round(seconds / step) + 1)
    longer = dataclasses.replace(
        motion.trajectory, time=frames * step, q=in_place[frames % _PERIOD], v=None
    )
    return dataclasses.replace(motion, name="treadmill", trajectory=longer)


def shoulder(solution: Any, recording: Any) -> Shoulder:
    """Compare the left shoulder of an estimate with the truth, from the end of the rest hold on."""
    from scipy.spatial.transform import Rotation

    from mocap_jax.metrics.align import align
    from mocap_jax.solution.angles import root_relative_angles
    from mocap_jax.solution.poses import root_segment, segment_poses

    pair = align(solution, recording)
    R, _ = segment_poses(pair.body, pair.q)
    R_true, _ = segment_poses(pair.reference_body, pair.reference_q)
    names, true = root_relative_angles(pair.reference_body, R_true, SEGMENT)
    _, found = root_relative_angles(pair.body, R, SEGMENT, near=true)
    sides = []
    for body, rotation in ((pair.body, R), (pair.reference_body, R_true)):
        arm, root = body.topology.body_index(SEGMENT), root_segment(body.topology)
        sides.append(np.swapaxes(rotation[:, root], -1, -2) @ rotation[:, arm])
    error = Rotation.from_matrix(sides[0] @ np.swapaxes(sides[1], -1, -2)).as_rotvec()
    return Shoulder(
        pair.time, names, np.rad2deg(found), np.rad2deg(true), np.rad2deg(error), pair.q,
        pair.reference_q,
    )  # fmt: skip


def keep(series: Shoulder, file: Path) -> None:
    """Write to an .npz file, whole or not at all."""
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(".part")
    with part.open("wb") as stream:
        np.savez_compressed(stream, **{f.name: getattr(series, f.name) for f in fields(series)})
    os.replace(part, file)


def read(file: Path) -> Shoulder:
    """Read what `keep` wrote."""
    with np.load(file) as kept:
        arrays = {f.name: kept[f.name] for f in fields(Shoulder)}
    return Shoulder(**arrays | {"names": tuple(map(str, arrays["names"]))})

"""The trackers that are compared, and errors pooled over trials."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mocap_jax.arm import ArmErrors, ArmTrack, joint_filter, optimised, paper_tracker
from mocap_jax.arm.errors import ROWS
from mocap_jax.recording import Recording
from mocap_jax.simulation.arm import ArmScene, declared

PAPER = "paper's UKF"
PLANAR = "planar UKF"
JOINTS = "joint UKF"
SMOOTHED = "smoothed"
OPTIMISER = "optimiser"
ROBUST = "robust"
TRACKERS = (PAPER, PLANAR, JOINTS, SMOOTHED, OPTIMISER, ROBUST)
TABLE_II = ArmErrors(np.array([0.10, 0.14, 0.88, -1.51]), np.array([1.18, 2.10, 2.58, 1.78]))
"""As printed: mean difference and standard deviation in the rows of `ROWS`."""


def track(
    recording: Recording, scene: ArmScene, wanted: tuple[str, ...] = TRACKERS
) -> dict[str, ArmTrack]:
    """All trackers on the same ranges; the optimisers start from the smoothed joint UKF."""
    out: dict[str, ArmTrack] = {}
    planar, sagittal = (declared(recording, scene, kind) for kind in ("planar", "sagittal"))
    if PAPER in wanted:
        out[PAPER] = paper_tracker(planar)
    if PLANAR in wanted:
        out[PLANAR] = joint_filter(planar)
    if JOINTS in wanted:
        out[JOINTS] = joint_filter(sagittal)
    if {SMOOTHED, OPTIMISER, ROBUST} & set(wanted):
        out |= _smoothed_first(sagittal, wanted)
    for name, found in out.items():
        if found.solution is not None and not found.solution.status.ok:
            print(f"  {name}: {found.solution.status.value}")
    return out


def _smoothed_first(sagittal: Recording, wanted: tuple[str, ...]) -> dict[str, ArmTrack]:
    """The smoothed joint UKF and what starts from it, as far as wanted."""
    start = joint_filter(sagittal, smooth=True)
    out = {SMOOTHED: start} if SMOOTHED in wanted else {}
    for name, robust in ((OPTIMISER, False), (ROBUST, True)):
        if name in wanted:
            out[name] = optimised(sagittal, robust=robust, initial=start)
    return out


def pooled(each: list[ArmErrors]) -> ArmErrors:
    """Mean and standard deviation over all pulses of equally long trials."""
    means, stds = np.array([e.mean for e in each]), np.array([e.std for e in each])
    return ArmErrors(means.mean(0), np.sqrt((stds**2).mean(0) + means.var(0)))


def print_table(columns: dict[str, ArmErrors]) -> None:
    """|mean| and standard deviation, a column a tracker."""
    print(f"{'|mean| +- std':18s}" + "".join(f"{name:>18s}" for name in columns))
    for i, row in enumerate(ROWS):
        cells = (f"{abs(e.mean[i]):.2f} +- {e.std[i]:.2f}" for e in columns.values())
        print(f"{row:18s}" + "".join(f"{cell:>18s}" for cell in cells))


def as_json(columns: dict[str, ArmErrors]) -> dict[str, dict[str, list[float]]]:
    """The same for programs."""
    return {k: {"mean": e.mean.tolist(), "std": e.std.tolist()} for k, e in columns.items()}


def verdicts(columns: dict[str, ArmErrors], test: Callable[[ArmErrors], np.ndarray]) -> str:
    """Rows in which each column passes a test."""
    parts = []
    for name, errors in columns.items():
        failed = [row for row, good in zip(ROWS, test(errors), strict=True) if not good]
        parts.append(f"{name}: {'yes' if not failed else 'not for ' + ', '.join(failed)}")
    return "; ".join(parts)

"""The Plaza 2 data (Djugash, Hamner, Roth 2009): odometry, ranges to beacons, and the truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from mocap_jax.estimate.range_only import AnchorRanges, Odometry


@dataclass(frozen=True)
class Plaza2:
    """One drive."""

    odometry: Odometry
    ranges: AnchorRanges
    beacons: dict[int, np.ndarray]
    """Positions by identity [m]."""
    start: np.ndarray
    """First pose as GTSAM's example gives it: x [m], y [m], heading [rad]."""
    truth_time: np.ndarray
    truth: np.ndarray
    """Positions by GPS (n, 2) [m]."""

    @property
    def anchors(self) -> np.ndarray:
        """(a, 2), in the order of `ranges.anchor`."""
        return np.array(list(self.beacons.values()))

    def errors(self, time: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Distances of a path from the truth [m]."""
        true = np.stack([np.interp(time, self.truth_time, x) for x in self.truth.T], axis=1)
        return np.linalg.norm(position - true, axis=1)


def read(folder: Path, steps: int | None = None) -> Plaza2:
    """Read the drive, or its first steps."""
    from scipy.io import loadmat

    from mocap_jax.estimate.range_only import AnchorRanges, Odometry

    tables: dict[str, Any] = loadmat(str(folder / "Plaza2_.mat"))
    dead_reckoned, truth = tables["DR"][:steps], tables["GT"]
    time = np.concatenate([[tables["DRp"][0, 0]], dead_reckoned[:, 0]])
    beacons = {int(row[0]): row[1:] for row in tables["TL"]}
    ranges = tables["TD"][tables["TD"][:, 0] <= time[-1]]
    index = {identity: i for i, identity in enumerate(beacons)}
    return Plaza2(
        Odometry(time, dead_reckoned[:, 1], dead_reckoned[:, 2]),
        AnchorRanges(ranges[:, 0], np.array([index[int(i)] for i in ranges[:, 2]]), ranges[:, 3]),
        beacons,
        # The table's heading is that of the vehicle's back.
        np.array([*truth[0, 1:3], truth[0, 3] + np.pi]),
        truth[:, 0],
        truth[:, 1:3],
    )

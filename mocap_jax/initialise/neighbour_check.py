"""Sensors that look exchanged, without a body or a mounting: neighbours turn alike.

Angular velocities in the world of neighbouring segments differ less than those of others. In the
world they do not depend on how a sensor is mounted; a constant heading offset between two sensors
is taken out pair by pair. Needs orientations; says nothing of left and right exchanged as a whole.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.initialise.reading_series import Series
from mocap_jax.initialise.sensor_assignment import MOTION_WEIGHT, SLOWEST_ALIKE, Costs, exchanged

_PARENT = {
    "L5": "Pelvis", "L3": "L5", "T12": "L3", "T8": "T12", "Neck": "T8", "Head": "Neck",
} | {
    side + child: (side + parent if parent not in ("T8", "Pelvis") else parent)
    for side in ("Left", "Right")
    for child, parent in (
        ("Shoulder", "T8"), ("UpperArm", "Shoulder"), ("ForeArm", "UpperArm"), ("Hand", "ForeArm"),
        ("UpperLeg", "Pelvis"), ("LowerLeg", "UpperLeg"), ("Foot", "LowerLeg"), ("Toe", "Foot"),
    )
}  # fmt: skip
"""Of Xsens' 23 segments."""
# Less motion than this tells nothing [rad/s]; fewer sensors have no neighbours to compare.
_LEAST, _FEWEST = 0.3, 3
# An exchange must lower the cost by this much, where motion is all the evidence: of real walking,
# exchanges of shanks, feet and pelvis lower it by 10 and more, chance by 0.6.
_MARGIN = 8.0


def exchanged_neighbours(
    series: dict[str, Series], segments: dict[str, str]
) -> list[tuple[str, ...]]:
    """Groups of sensors each of which fits the place of the next clearly better.

    Args:
        series: readings by sensor.
        segments: Xsens segment that each sensor is said to be on; others are left out.
    """
    rates = {n: r for n, s in series.items() if segments.get(n) and (r := _world(s)) is not None}
    names = [n for n in rates if segments[n] == "Pelvis" or segments[n] in _PARENT]
    edges = _edges([segments[n] for n in names])
    if len(names) < _FEWEST or not edges:
        return []
    length = min(len(rates[n]) for n in names)
    rate = np.stack([rates[n][:length] for n in names])
    seen = np.isfinite(rate).all(axis=(0, 2))
    rate = rate[:, seen]
    if seen.sum() < 100 or np.sqrt((rate**2).sum(-1).mean()) < _LEAST:
        return []
    count = len(names)
    motion = np.broadcast_to(_pair_costs(rate), (len(edges), count, count))
    nothing = np.zeros((count, count))
    costs = Costs(nothing, nothing, edges, motion)
    movable = np.ones(count, bool)
    worn = exchanged(costs, nothing, movable, parts=False, margin=_MARGIN).worn
    return [tuple(names[i] for i in group) for group in cycles(np.argsort(worn))]


def cycles(site: np.ndarray) -> list[list[int]]:
    """Cycles of a permutation: each sensor fits the place of the next one."""
    groups: list[list[int]] = []
    for start in range(len(site)):
        if site[start] == start or any(start in g for g in groups):
            continue
        group = [start]
        while site[group[-1]] != start:
            group.append(int(site[group[-1]]))
        groups.append(group)
    return groups


def _world(series: Series) -> np.ndarray | None:
    """Angular velocity in the world from differences of orientations; None without them."""
    good = np.isfinite(series.orientation).all(axis=1)
    if good.sum() < 3:
        return None
    q = np.where(good[:, None], series.orientation, [1.0, 0.0, 0.0, 0.0])
    turn = Rotation.from_quat(q, scalar_first=True)
    rate = turn[:-1].apply((turn[:-1].inv() * turn[1:]).as_rotvec()) / series.step
    return np.where((good[:-1] & good[1:])[:, None], rate, np.nan)


def _edges(segments: list[str]) -> list[tuple[int, int]]:
    """Sensors on neighbouring segments: nearest carrier towards the pelvis."""
    edges = []
    for i, segment in enumerate(segments):
        above = _PARENT.get(segment)
        while above is not None and above not in segments:
            above = _PARENT.get(above)
        if above is not None:
            edges.append((segments.index(above), i))
    return edges


def _pair_costs(rate: np.ndarray) -> np.ndarray:
    """Cost of two sensors as neighbours, at the heading offset that makes them most alike."""
    samples = rate.shape[1]
    own = (rate**2).sum((1, 2)) / samples
    level = rate[..., 0] + 1j * rate[..., 1]
    cross = np.abs(level @ level.conj().T) + rate[..., 2] @ rate[..., 2].T
    apart = np.maximum(own[:, None] + own[None] - 2 * cross / samples, 0.0)
    return 0.5 * MOTION_WEIGHT * np.log(apart + SLOWEST_ALIKE**2)

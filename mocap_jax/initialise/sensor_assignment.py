"""Which sensor is worn where: the declared assignment against exchanges of sensors.

The cost of an assignment adds three things, each a sum of squares in nominal standard deviations,
made robust: the direction of gravity in every sensor at rest, its distances from the sources at
rest, and the rates of neighbouring segments relative to each other, which are small where each
sensor is where it is said to be. Pairs are exchanged as long as that lowers the cost decisively:
whole sensors, or their inertial data or distances alone, as swapped cables or names in a driver do,
which leave the other where it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Topology
from mocap_jax.initialise.sensor_evidence import Evidence

# Tilt by which a declared pose and nominal mounting may be wrong [rad], and distances [m] (3 deg
# an axis in every joint and board, 3 % in lengths): our choice, with margin.
_TILT, _DISTANCE = np.deg2rad(12.0), 0.05
# The same without a declared pose.
_TILT_UNDECLARED, _DISTANCE_UNDECLARED = np.deg2rad(30.0), 0.25
# Ranges of one receiver err together: they count as at most this many.
_INDEPENDENT = 3.0
# Standard deviations beyond which a misfit counts logarithmically.
_SCALE = 4.0
# Relative rate below which two neighbours move alike [rad/s].
SLOWEST_ALIKE = 0.05
# Independent observations that the ratio of two mean square relative rates is worth.
MOTION_WEIGHT = 12.0
# The cost must fall by this much for an exchange to be believed.
_MARGIN = 2.0
# More of it for an exchange of inertial data or distances alone, which is the rarer mistake.
_MARGIN_PART = 4.0
TURNED = np.deg2rad(40.0)
"""Tilt that no pose and mounting of ordinary care explain [rad]."""
What = Literal["both", "inertial", "ranges"]


class Assignment(NamedTuple):
    """Which sensor's readings belong to each of s sites."""

    worn: np.ndarray
    """Sensor whose inertial data belong to the site."""
    heard: np.ndarray
    """Sensor whose distances belong there; the same one but for an exchange of data alone."""

    def swapped(self, a: int, b: int, what: What) -> Assignment:
        """With the sensors at two sites exchanged, or one kind of their data."""
        return Assignment(
            self.worn if what == "ranges" else _swapped(self.worn, a, b),
            self.heard if what == "inertial" else _swapped(self.heard, a, b),
        )


class Costs(NamedTuple):
    """Costs of s sensors at s sites."""

    gravity: Float[np.ndarray, "s s"]
    """Of sensor i (row) at site j (column), from the direction of gravity at rest."""
    ranges: Float[np.ndarray, "s s"]
    """The same from the distances at rest."""
    edges: list[tuple[int, int]]
    """Sites on neighbouring segments."""
    motion: Float[np.ndarray, "e s s"]
    """Of sensors (i, k) at the two sites of each edge."""

    def total(self, assignment: Assignment) -> float:
        """Cost of an assignment."""
        worn, site = assignment.worn, np.arange(len(assignment.worn))
        rest = self.gravity[worn, site].sum() + self.ranges[assignment.heard, site].sum()
        motion = (self.motion[e, worn[a], worn[b]] for e, (a, b) in enumerate(self.edges))
        return float(rest + sum(motion))

    def without_motion_of(self, left_out: np.ndarray) -> Costs:
        """The same without what the motion of some sensors (mask) and of their places tells."""
        kept = np.array([not (left_out[a] or left_out[b]) for a, b in self.edges], bool)
        motion = np.where(left_out[:, None] | left_out[None], 0.0, self.motion)
        return self._replace(motion=motion * kept[:, None, None])


def assignment_costs(
    evidence: Evidence, rate: Float[np.ndarray, "s t 3"], topology: Topology
) -> Costs:
    """Costs of all assignments; `rate` as of `world_rates`."""
    edges = neighbours(topology, evidence.segments)
    return Costs(
        _gravity_cost(evidence), _ranges_cost(evidence), edges, _motion_cost(evidence, rate, edges)
    )


def neighbours(topology: Topology, segments: tuple[int, ...]) -> list[tuple[int, int]]:
    """Pairs of sensors on neighbouring segments: nearest carrier up the tree, or the same one."""
    edges = []
    for i, segment in enumerate(segments):
        above = segment if segment in segments[:i] else topology.body_parent[segment]
        while above and above not in segments:
            above = topology.body_parent[above]
        if above:
            edges.append((segments.index(above), i))
    return edges


def exchanged(
    costs: Costs,
    tilt: Float[np.ndarray, "s s"],
    movable: np.ndarray,
    *,
    parts: bool = True,
    margin: float = _MARGIN,
) -> Assignment:
    """The assignment that explains the readings.

    Args:
        costs: of the assignments.
        tilt: as of `tilts`; no sensor moves to a site where it is beyond `TURNED`.
        movable: mask of the sensors that may be exchanged.
        parts: whether inertial data or distances alone may be exchanged.
        margin: by how much the cost must fall for an exchange of whole sensors to be believed.
    """
    sites = np.arange(len(movable))
    best = Assignment(sites, sites)
    allowed = ~(tilt > TURNED) & movable[:, None]
    current = costs.total(best)
    while True:
        trials = list(_trials(best, allowed, parts, margin))
        gains = [current - costs.total(trial) - least for trial, least in trials]
        if not gains or max(gains) < 0:
            return best
        best = trials[gains.index(max(gains))][0]
        current = costs.total(best)


def _trials(
    current: Assignment, allowed: np.ndarray, parts: bool, margin: float
) -> Iterator[tuple[Assignment, float]]:
    """Assignments that differ by one exchange, each with how much better it must be."""
    worn = current.worn
    for a in range(len(worn)):
        for b in range(a):
            if allowed[worn[a], b] and allowed[worn[b], a]:
                yield current.swapped(a, b, "both"), margin
                if parts:
                    yield current.swapped(a, b, "inertial"), _MARGIN_PART
            if parts and allowed[worn[a], a] and allowed[worn[b], b]:
                yield current.swapped(a, b, "ranges"), _MARGIN_PART


def _swapped(worn: np.ndarray, a: int, b: int) -> np.ndarray:
    trial = worn.copy()
    trial[[a, b]] = worn[[b, a]]
    return trial


def tilts(evidence: Evidence) -> Float[np.ndarray, "s s"]:
    """Angle [rad] between measured gravity of sensor i and the one expected at site j."""
    return np.arccos(np.clip(evidence.up @ evidence.expected_up.T, -1.0, 1.0))


def _gravity_cost(evidence: Evidence) -> np.ndarray:
    tilt = _TILT if evidence.declared else _TILT_UNDECLARED
    return np.nan_to_num(_robust((tilts(evidence) / tilt) ** 2))


def _ranges_cost(evidence: Evidence) -> np.ndarray:
    spread = _DISTANCE if evidence.declared else _DISTANCE_UNDECLARED
    z = (evidence.distance[:, None] - evidence.expected[None]) / spread
    heard = np.isfinite(z)
    count = np.maximum(heard.sum(-1), 1)
    return np.where(heard, _robust(z**2), 0.0).sum(-1) * np.minimum(1.0, _INDEPENDENT / count)


def _robust(squared: np.ndarray) -> np.ndarray:
    return 0.5 * _SCALE**2 * np.log1p(squared / _SCALE**2)


def _motion_cost(evidence: Evidence, rate: np.ndarray, edges: list[tuple[int, int]]) -> np.ndarray:
    sensors, samples = len(evidence.sensors), max(rate.shape[1], 1)
    out = np.zeros((len(edges), sensors, sensors))
    own = (rate**2).sum((1, 2)) / samples
    for e, (a, b) in enumerate(edges):
        first, second = (rate @ evidence.R_world_site[site].T for site in (a, b))
        cross = first.reshape(sensors, -1) @ second.reshape(sensors, -1).T / samples
        apart = np.maximum(own[:, None] + own[None] - 2 * cross, 0.0)
        out[e] = 0.5 * MOTION_WEIGHT * np.log(apart + SLOWEST_ALIKE**2)
    return out

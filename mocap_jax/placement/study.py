"""`place`: where sensors should go, and how sure that is."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from mocap_jax.body import Body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.motion import Motion
from mocap_jax.placement.certificate import Certificate
from mocap_jax.placement.distance import DistanceError, Keeper
from mocap_jax.placement.evaluation import Criterion, Evaluation
from mocap_jax.placement.mounting import mounting_at, with_probe
from mocap_jax.placement.options import PlacementOptions
from mocap_jax.placement.result import CurvePoint, Placement, PlacementStudy
from mocap_jax.placement.rows import Boards
from mocap_jax.placement.scene import scenes_of
from mocap_jax.placement.search import boards_on, refine, value_of
from mocap_jax.placement.selection import Candidates, Selector, Subset
from mocap_jax.placement.spacing import Resting, farthest
from mocap_jax.placement.surface import Patch, Surfaces, patches_of
from mocap_jax.simulation import Suit
from mocap_jax.simulation.anatomy import anatomy_of
from mocap_jax.simulation.mounting import with_shapes

# Placements of the ranking whose places are optimised; the others keep their patches' middles.
_REFINED = 2
# Share of the evaluations that each other number of sensors of the curve may use.
_CURVE_SHARE = 0.25


def place(
    body: Body,
    motions: Sequence[Motion],
    options: PlacementOptions = PlacementOptions(),  # noqa: B008  (frozen)
    *,
    progress: bool = False,
) -> PlacementStudy:
    """Choose segments, places and orientations of inertial sensors for a set of motions.

    Args:
        body: who wears them.
        motions: what they should be good for, on this body (`retarget` brings others to it).
        options: number and kind of sensors, criterion, constraints, search.
        progress: show a progress bar (stderr).

    Raises:
        InputError: an impossible request; the text names the valid choices.
        DistanceError: no choice was found whose sensors keep the least distance.
    """
    begin = time.perf_counter()
    with tqdm(desc="place", unit="evaluation", disable=not progress) as bar:
        study = _Study(body, tuple(motions), options, bar)
        return study.run(begin)


def carrying_segments(body: Body, allowed: Sequence[str] = ()) -> tuple[str, ...]:
    """Segments of a body that may carry a sensor (Xsens names).

    Args:
        body: who wears them.
        allowed: segments that may, by Xsens names or the body's own; empty means all.

    Raises:
        InputError: a segment that does not exist or has no reachable patch; no segment at all.
    """
    return tuple(p.segment for p in patches_of(with_shapes(body), tuple(allowed)))


class Judge:
    """Expected errors of placements on a body for some motions, without a search."""

    def __init__(self, body: Body, motions: Sequence[Motion], options: PlacementOptions) -> None:
        self.body, probed = with_probe(body)
        self.options = options
        self.criterion = Criterion(scenes_of(probed, tuple(motions), options), options)

    def evaluate(self, suit: Suit, size: int | None = None) -> Evaluation:
        """Expected errors of a suit's boards.

        Args:
            suit: boards on segments of the body (own or Xsens names).
            size: number of boards that the program is compiled for; default as many as there are.
        """
        segments = anatomy_of(self.body).segments
        for b in suit.boards:
            if b.segment not in segments:
                raise unknown_name(f"segment of '{b.name}':", b.segment, segments)
        spare = (size or len(suit.boards)) - len(suit.boards)
        index = [segments[b.segment] for b in suit.boards]
        position = np.array([b.position for b in suit.boards] + [(0.0, 0.0, 0.0)] * spare)
        weight = np.concatenate([np.ones(len(index)), np.zeros(spare)])
        boards = Boards(
            jnp.asarray(index + index[:1] * spare), jnp.asarray(position), jnp.asarray(weight)
        )
        return self.criterion.evaluate(boards)


class _Study:
    def __init__(
        self, body: Body, motions: tuple[Motion, ...], options: PlacementOptions, bar: tqdm
    ) -> None:
        self.options, self.bar = options, bar
        # What is cheap to check comes before what takes long.
        c, shaped = options.constraints, with_shapes(body)
        self.patches = patches_of(shaped, c.allowed)
        if options.sensors > len(self.patches):
            raise InputError(
                f"sensors {options.sensors}: more than the {len(self.patches)} segments that may "
                "carry one"
            )
        self.most = min(options.most or options.sensors + 2, len(self.patches))
        self.middle = Surfaces(self.patches).places(jnp.zeros((len(self.patches), 2)))
        self.resting = _resting(shaped)
        self.keeper = Keeper(self.patches, self.resting, c.distance_m, options.search)
        relaxable = options.objective != "D"
        self.selector = Selector(
            _candidates(shaped, self.patches, options, self.resting), c, self._value,
            self._relax if relaxable else None, self.bar.update,
        )  # fmt: skip
        judge = Judge(body, motions, options)
        self.body, self.criterion = judge.body, judge.criterion

    def run(self, begin: float) -> PlacementStudy:
        """The whole study."""
        budget = self.options.search.evaluations
        curve: dict[int, tuple[Subset, Certificate]] = {}
        for count in range(1, self.most + 1):
            chosen = count == self.options.sensors
            found = self._choose(count, budget if chosen else int(_CURVE_SHARE * budget))
            if found is not None:
                curve[count] = found
        certificate = curve[self.options.sensors][1]
        ranked = self.keeper.kept(self.selector.ranking(self.options.sensors))
        best = [s for _, s in islice(ranked, self.options.search.ranked)]
        placements = [self._refined(s) for s in best[:_REFINED]]
        placements += [self._apart(s) for s in best[_REFINED:]]
        points = tuple(self._point(n, *found) for n, found in curve.items())
        return PlacementStudy(
            self.body, tuple(s.name for s in self.criterion.scenes),
            tuple(sorted(placements, key=lambda p: p.value)), points, certificate, self.options,
            time.perf_counter() - begin,
        )  # fmt: skip

    def _choose(self, count: int, budget: int) -> tuple[Subset, Certificate] | None:
        """Best subset of a size; other sizes than the one asked for may be impossible."""
        chosen = count == self.options.sensors
        try:
            _, certificate = self.selector.choose(count, budget=max(budget, 1), bound=chosen)
            return self._kept(count, certificate)
        except InputError:
            if chosen:
                raise
            return None

    def _kept(self, count: int, certificate: Certificate) -> tuple[Subset, Certificate]:
        """Best subset whose sensors can be far enough apart, and what is known of it."""
        found = next(self.keeper.kept(self.selector.ranking(count)), None)
        if found is None:
            raise DistanceError(
                f"distance_m {self.keeper.distance:g}: no choice of {count} segments was found "
                "whose sensors can be so far from each other"
            )
        dropped, subset = found
        value = self.selector.values[subset]
        bound = value if certificate.exhaustive else min(certificate.bound, value)
        return subset, replace(certificate, value=value, bound=bound, dropped=dropped)

    def _point(self, count: int, subset: Subset, certificate: Certificate) -> CurvePoint:
        found = self._apart(subset)
        return CurvePoint(
            count, found.segments, found.mean_cm, found.mean_deg, certificate.exhaustive
        )

    def _names(self, subset: Subset) -> tuple[str, ...]:
        return tuple(self.patches[i].segment for i in subset)

    def _middles(self, subset: Subset) -> np.ndarray:
        return np.asarray(self.middle)[list(subset)]

    def _value(self, subset: Subset) -> float:
        patches = tuple(self.patches[i] for i in subset)
        return value_of(self.criterion, patches, self._middles(subset), self.most).value

    def _relax(self, weights: np.ndarray) -> tuple[float, float, np.ndarray]:
        points = Surfaces(self.patches).points(self.middle)
        boards = boards_on(self.patches, points)._replace(weight=jnp.asarray(weights))
        evaluation = self.criterion.evaluate(boards)
        cut = self.criterion.cut(boards, evaluation)
        return evaluation.value, cut.constant, cut.slope

    def _apart(self, subset: Subset) -> Placement:
        """Sensors near the middles of a kept subset's patches, as far apart as they must be."""
        places = self.keeper.places(subset)
        assert places is not None
        return self._placement(subset, places)

    def _refined(self, subset: Subset) -> Placement:
        found = refine(
            self.criterion, tuple(self.patches[i] for i in subset), self.resting,
            self.options.search, distance=self.options.constraints.distance_m, size=self.most,
            report=self.bar.update,
        )  # fmt: skip
        return self._placement(subset, found.places)

    def _placement(self, subset: Subset, places: np.ndarray) -> Placement:
        patches = tuple(self.patches[i] for i in subset)
        evaluation = value_of(self.criterion, patches, places, self.most)
        joints = self.criterion.scenes[0].joints
        cm, deg = (
            unit * np.sqrt(self.criterion.variance_of(evaluation, quantity).mean(0))
            for quantity, unit in (("position", 100.0), ("orientation", 180 / np.pi))
        )
        boards = tuple(mounting_at(p, x) for p, x in zip(patches, places, strict=True))
        return Placement(
            self._names(subset), np.asarray(places), Suit(boards), evaluation.value,
            *(dict(zip(joints, map(float, x), strict=True)) for x in (cm, deg)),
        )  # fmt: skip


def _resting(body: Body) -> Resting:
    anatomy = anatomy_of(body)
    count = body.topology.nbody
    return Resting(
        np.array([anatomy.rotation(b) for b in range(count)]), np.array(anatomy.data.xpos[:count])
    )


def _candidates(
    body: Body, patches: tuple[Patch, ...], options: PlacementOptions, resting: Resting
) -> Candidates:
    """Costs, lengths of wire and greatest distances of all patches."""
    c = options.constraints
    names = tuple(p.segment for p in patches)
    for name in c.costs:
        if name not in names:
            raise unknown_name("segment with a cost", name, names)
    wire = np.zeros(len(patches))
    if c.wire_m is not None:
        wire = np.array([_wire(body, p.body, c.hub) for p in patches])
    cost = np.array([c.costs.get(n, 1.0) for n in names])
    return Candidates(names, cost, wire, farthest(patches, resting))


def _wire(body: Body, carrier: int, hub: str) -> float:
    """Length along the body from a segment's joint to the hub's [m]."""
    segments = anatomy_of(body).segments
    if hub not in segments:
        raise unknown_name("hub segment", hub, segments)
    parent, length = body.topology.body_parent, np.linalg.norm(np.asarray(body.body_pos), axis=1)

    def chain(b: int) -> list[int]:
        return [b, *chain(parent[b])] if b else []

    one, other = set(chain(carrier)), set(chain(segments[hub]))
    return float(sum(length[b] for b in one ^ other))

"""Which ultrasonic sources of a suit are worth their place: distances added to the boards.

Pulses are shared: sources fire in turn, so half as many are heard twice as often each. What the
body hides or the beam does not reach counts for nothing: both are traced along the true motion, by
the simulator's own rays. Constants of sources (place, constant error of their ranges) and of boards
(offset) are unknown, as for the estimator; lengths and the speed of sound count as known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from tqdm import tqdm

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion import Motion
from mocap_jax.placement.evaluation import right_hand_sides
from mocap_jax.placement.options import Constraints, ErrorModel, PlacementOptions
from mocap_jax.placement.posterior import board_corner, factored
from mocap_jax.placement.rows import CONSTANTS, Boards, system_of
from mocap_jax.placement.scene import Scene, performance_of, scenes_of
from mocap_jax.placement.selection import Candidates, Certificate, Selector, Subset
from mocap_jax.simulation import SimulationOptions, Suit, mount
from mocap_jax.simulation.flight import Flights, fly
from mocap_jax.simulation.hearing import HearingFigures, signal_confidence
from mocap_jax.simulation.mounting import with_shapes
from mocap_jax.simulation.rest_hold import Performance
from mocap_jax.simulation.rig import build_rig

# Of a source: place and constant error of its ranges.
_OWN = 4


@dataclass(frozen=True)
class SourceStudy:
    """Sources ranked by what a suit loses without the others."""

    chosen: tuple[str, ...]
    suit: Suit
    """The suit with these sources only."""
    expected_cm: float
    """Mean expected error of joint centres with them."""
    all_cm: float
    """The same with all sources."""
    none_cm: float
    """The same without distances."""
    certificate: Certificate

    @property
    def loss(self) -> float:
        """Relative growth of the expected error by leaving the others out."""
        return self.expected_cm / self.all_cm - 1.0


@dataclass(frozen=True)
class _Heard:
    """What each source adds to the equations of one motion, at one pulse a second."""

    lower: Float[np.ndarray, "s t nv nv"]
    boards: Float[np.ndarray, "s t nv m"]
    """Coupling of poses and boards' constants."""
    own: Float[np.ndarray, "s t nv 4"]
    corner: Float[np.ndarray, "s m m"]
    own_corner: Float[np.ndarray, "s 4 4"]
    cross: Float[np.ndarray, "s m 4"]


def choose_sources(
    body: Body,
    motions: Sequence[Motion],
    suit: Suit,
    count: int,
    options: PlacementOptions = PlacementOptions(),  # noqa: B008  (frozen)
    *,
    progress: bool = False,
) -> SourceStudy:
    """Choose the sources of a suit to keep, by exhaustive search or exchange.

    Args:
        body: who wears it.
        motions: what it should be good for, on this body.
        suit: boards (all with a microphone) and candidate sources.
        count: how many sources to keep.
        options: criterion A of joint centres over the mean of motions; grid, errors and search
            are used.
        progress: show a progress bar (stderr).

    Raises:
        InputError: fewer sources than that.
    """
    if not 0 < count <= len(suit.sources):
        raise InputError(f"count {count}: the suit has {len(suit.sources)} sources")
    options = replace(options, quantity="position")
    worn = mount(with_shapes(body), suit)
    scenes = scenes_of(worn, tuple(motions), options)
    judge = _SourceJudge(scenes, worn, suit, tuple(motions), options)
    names = tuple(s.name for s in suit.sources)
    with tqdm(desc="sources", unit="evaluation", disable=not progress) as bar:
        selector = Selector(
            Candidates(names, np.ones(len(names)), np.zeros(len(names))), Constraints(),
            judge.value, report=bar.update,
        )  # fmt: skip
        best, certificate = selector.choose(count, budget=options.search.evaluations)
    kept = Suit(suit.boards, tuple(suit.sources[i] for i in best), suit.omitted)
    everything = tuple(range(len(names)))
    return SourceStudy(
        tuple(names[i] for i in best), kept, judge.mean_cm(best), judge.mean_cm(everything),
        judge.mean_cm(()), certificate,
    )  # fmt: skip


class _SourceJudge:
    """Expected errors by subset of sources."""

    def __init__(
        self, scenes: tuple[Scene, ...], worn: Body, suit: Suit, motions: tuple[Motion, ...],
        options: PlacementOptions,
    ) -> None:  # fmt: skip
        self.scenes, self.options, self.errors = scenes, options, options.errors
        index = [worn.topology.site_body[worn.site_index(b.name)] for b in suit.boards]
        position = np.array([b.position for b in suit.boards])
        self.boards = Boards(np.asarray(index), position, np.ones(len(index)))
        self.heard = [
            _heard(s, worn, suit, performance_of(m), options)
            for s, m in zip(scenes, motions, strict=True)
        ]
        self.base = [self._without(s) for s in scenes]
        self.right = [
            right_hand_sides(s, options, np.random.default_rng((options.search.seed, i)))
            for i, s in enumerate(scenes)
        ]

    def _without(self, scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Equations of priors and boards."""
        t = scene.frames
        system = system_of(scene.body.topology, scene.kinematics, self.boards, self.errors)
        return (
            np.asarray(system.lower)[:t] + scene.prior.lower,
            np.swapaxes(np.asarray(system.border)[:t], 1, 2),
            board_corner(np.asarray(system.corner), self.errors),
        )

    def variance(self, subset: Subset) -> Float[np.ndarray, "motions j"]:
        """Expected squared errors of joint centres [m^2]."""
        out = []
        for scene, heard, base, right in zip(
            self.scenes, self.heard, self.base, self.right, strict=True
        ):
            posterior = factored(*_joined(base, heard, subset, self.errors))
            x, _ = posterior.solve(right)
            quadratic = np.einsum("tvp,tvp->p", right, x)
            out.append(quadratic.reshape(len(scene.joints), -1).mean(1))
        return np.array(out)

    def value(self, subset: Subset) -> float:
        """Mean squared error [m^2]."""
        return float(self.variance(subset).mean())

    def mean_cm(self, subset: Subset) -> float:
        """Mean of the joints' root mean square errors [cm]."""
        return float(100 * np.sqrt(self.variance(subset).mean(0)).mean())


def _joined(
    base: tuple[np.ndarray, np.ndarray, np.ndarray], heard: _Heard, subset: Subset,
    errors: ErrorModel,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Equations with some sources, which share the pulses."""
    lower, border, corner = (x.copy() for x in base)
    m, share = border.shape[2], 1 / max(len(subset), 1)
    c = errors.constants
    sigma = np.maximum([c.source_sigma] * 3 + [c.range_offset_sigma], 1e-7)
    whole = np.zeros((m + _OWN * len(subset),) * 2)
    whole[:m, :m] = corner
    columns = [border]
    for i, s in enumerate(subset):
        lower[:, 0] += share * heard.lower[s]
        border += share * heard.boards[s]
        columns.append(share * heard.own[s])
        cells = slice(m + _OWN * i, m + _OWN * (i + 1))
        whole[:m, :m] += share * heard.corner[s]
        whole[cells, cells] = share * heard.own_corner[s] + np.diag(1 / sigma**2)
        whole[:m, cells] = share * heard.cross[s]
        whole[cells, :m] = whole[:m, cells].T
    return lower, np.concatenate(columns, axis=2), whole


def _heard(
    scene: Scene, worn: Body, suit: Suit, performance: Performance, options: PlacementOptions
) -> _Heard:
    """Information of every source, were it the only one."""
    t, boards = scene.frames, tuple(b.name for b in suit.boards)
    interval, step = SimulationOptions().pulse_interval_s, 1 / options.rate_hz
    rig = build_rig(worn, boards, suit.source_sites)
    flights = fly(
        rig, performance.spline(rig.topology), end=performance.time[-1] - 4 * interval,
        pulse_interval=interval, speed_of_sound=SimulationOptions().speed_of_sound,
    )  # fmt: skip
    noise = options.errors.noise.range**2 + options.errors.model.range_model**2
    parts = []
    for s in range(len(suit.sources)):
        clear = _clear(flights, s, step * (np.arange(t) + 0.5))
        parts.append(_one_source(scene, worn, suit, s, clear * step / interval / noise))
    stack = [np.stack(x) for x in zip(*parts, strict=True)]
    return _Heard(*stack)


def _clear(flights: Flights, source: int, time: np.ndarray) -> Float[np.ndarray, "t r"]:
    """Confidence with which each board hears a source around each frame."""
    rows = flights.source == source
    figures, cosine = HearingFigures(), flights.cosine[rows]
    beam = np.where(cosine > 0, ((1 + np.clip(cosine, 0, 1)) / 2) ** figures.beam, 0.0)
    way = np.maximum(flights.distance[rows], 0.05)
    audible = (way < SimulationOptions().max_range_m) & ~flights.occluded[rows]
    heard = np.where(audible, signal_confidence(beam / way, way, figures), 0.0)
    nearest = np.abs(flights.time[rows][:, None] - time).argmin(0)
    return heard[nearest] ** 2


def _one_source(
    scene: Scene, worn: Body, suit: Suit, source: int, information: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Sums of the rows of one source to all boards."""
    k, t, topology = scene.kinematics, scene.frames, scene.body.topology
    R, p, angular, linear = (
        np.asarray(x)[:t] for x in (k.rotation, k.position, k.angular, k.linear)
    )
    site = worn.site_index(suit.source_sites[source])
    sites = [worn.site_index(b.name) for b in suit.boards]

    def moved(index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        b = topology.site_body[index]
        at = p[:, b] + R[:, b] @ np.asarray(worn.site_pos)[index]
        speed = topology.body_dofs[b][None, :, None] * (linear + np.cross(angular, at[:, None, :]))
        return at, np.swapaxes(speed, 1, 2), R[:, b]

    origin, source_speed, R_source = moved(site)
    n, nv, m = len(sites), topology.nv, CONSTANTS * len(sites)
    rows, own = np.zeros((t, n, nv)), np.zeros((t, n, _OWN))
    boards = np.zeros((t, n, m))
    for r, index in enumerate(sites):
        at, speed, R_board = moved(index)
        way = at - origin
        direction = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
        rows[:, r] = np.einsum("ti,tiv->tv", direction, speed - source_speed)
        own[:, r, :3] = -np.einsum("ti,tij->tj", direction, R_source)
        own[:, r, 3] = 1.0
        # A board's offset stands last among its constants.
        cells = slice(CONSTANTS * r + 9, CONSTANTS * r + 12)
        boards[:, r, cells] = np.einsum("ti,tij->tj", direction, R_board)
    root = np.sqrt(information)[..., None]
    rows, own, boards = root * rows, root * own, root * boards
    pair = lambda a, b: np.swapaxes(a, 1, 2) @ b  # noqa: E731
    flat = lambda x: x.reshape(-1, x.shape[2])  # noqa: E731
    return (
        pair(rows, rows), pair(rows, boards), pair(rows, own), flat(boards).T @ flat(boards),
        flat(own).T @ flat(own), flat(boards).T @ flat(own),
    )  # fmt: skip

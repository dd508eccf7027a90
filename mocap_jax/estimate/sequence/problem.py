"""`SequenceProblem`: a whole-sequence least-squares problem as the solver sees it.

The state is all poses and the sensors' constants. The solver asks for the cost, for the normal
equations, and for the state after a step; this file runs the traced chunks and keeps the books.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mocap_jax import linalg
from mocap_jax.body import Body, retract
from mocap_jax.errors import SolveError
from mocap_jax.estimate.sequence.assemble import (
    ChunkSystem,
    ChunkValues,
    assemble_chunk,
    chunk_border,
    evaluate_chunk,
)
from mocap_jax.estimate.sequence.border import Border
from mocap_jax.estimate.sequence.chunks import ChunkedTerms, cast
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.corner import add_chunk, prior_equations
from mocap_jax.estimate.sequence.jitter import bending, least_damping
from mocap_jax.estimate.sequence.layout import (
    Ground,
    Layout,
    Terms,
    Weights,
)
from mocap_jax.estimate.sequence.model_gradient import model_gradient, moved_constants
from mocap_jax.least_squares import Follow, NormalEquations


@dataclass(frozen=True)
class State:
    """The unknowns: poses (t, nq) and sensor constants."""

    q: Float[np.ndarray, "t nq"]
    constants: Constants


class SequenceProblem:
    """Cost, normal equations and retraction of one sequence."""

    def __init__(
        self,
        layout: Layout,
        body: Body,
        terms: Terms,
        weights: Weights,
        prior_information: Float[np.ndarray, "m"],
        dtype: np.dtype | None = None,
        refines: bool = False,
        readings: tuple[np.ndarray, np.ndarray] | None = None,
        mixing: np.ndarray | None = None,
    ) -> None:
        """Args:
        layout: shape of the problem.
        body: the body, sites included.
        terms: measurements of t frames, without NaN.
        weights: scalars.
        prior_information: inverse variances of the constants about zero, in their order.
        dtype: of the traced part; the linear solve is always float64.
        refines: steps need the accuracy of J (a root seen through accelerations alone).
        readings: direct measurements of the constants and their inverse variances, (m,) each.
        mixing: what these are measurements of (m, m), see `prior_equations`.
        """
        self.refines = refines
        self.dtype = dtype = dtype or np.dtype(np.float64)
        self.layout = layout
        # The model's text would be part of the compilation key.
        self.body = cast(dataclasses.replace(body, xml=""), dtype)
        self.weights = cast(weights, dtype)
        self.prior_information = np.ravel(prior_information)
        self.readings = readings or (np.zeros(layout.constants), np.zeros(layout.constants))
        self.mixing = mixing
        self.chunked = ChunkedTerms(layout, terms, dtype)
        self.frames = self.chunked.frames
        self._lower: np.ndarray | None = None
        self._retract = jax.jit(jax.vmap(lambda a, d: retract(layout.topology, a, d)))

    @property
    def bends(self) -> np.ndarray:
        """Degrees of freedom whose jitter is damped (nv,)."""
        return bending(self.layout)

    @property
    def least_damping(self) -> float:
        """A share of how firmly boards hold second differences of joint angles [1/rad^2]."""
        frames = slice(self.layout.halo, self.layout.halo + self.frames)
        terms = self.chunked.padded
        rate, force = terms.rate_information, terms.force_information
        return least_damping(rate[frames], force[frames], self.step)

    @property
    def terms(self) -> Terms:
        """Measurements and information of all frames."""
        return self.chunked.whole

    @property
    def step(self) -> float:
        """Time between frames [s]."""
        return float(self.weights.step)

    @property
    def program(self) -> tuple[object, ...]:
        """What the traced functions are compiled for."""
        return self.layout, self.dtype, self.chunked.padded.range_distance.shape[1]

    @property
    def unknowns(self) -> int:
        """Number of scalar unknowns."""
        return self.frames * self.layout.topology.nv + self.layout.constants

    def replace_terms(self, **changes: np.ndarray | tuple[np.ndarray, ...]) -> None:
        """Exchange measurement or information arrays of (t, ...) frames."""
        self.chunked.replace(**changes)

    def replace_weights(self, **changes: np.ndarray | float | Ground) -> None:
        """Exchange numbers of the traced part."""
        numbers = lambda x: jnp.asarray(x, self.dtype)  # noqa: E731
        cast: dict[str, Any] = {k: jax.tree.map(numbers, value) for k, value in changes.items()}
        self.weights = dataclasses.replace(self.weights, **cast)

    def _inputs(self, state: State) -> Iterator[tuple]:
        """Arguments of the traced functions, chunk by chunk."""
        constants = cast(state.constants, self.dtype)
        for rows, terms in self.chunked.with_poses(state.q):
            yield self.body, rows, constants, terms

    def _values(self, state: State) -> list[ChunkValues]:
        return [evaluate_chunk(self.layout, *a, self.weights) for a in self._inputs(state)]

    def cost(self, state: State) -> float:
        """Half the sum of robust squared whitened residuals, priors included."""
        parts = self._values(state)
        return float(sum(float(p.cost) for p in parts)) + self._prior(state.constants)[0]

    def linearise(self, state: State, follow: Follow | None = None) -> NormalEquations:
        """Cost, gradient and block-banded normal equations at a state.

        Args:
            state: poses and constants.
            follow: called with the blocks of the chunks that are done, while the next is computed.
        """
        width, nv = self.layout.half_bandwidth + 1, self.layout.topology.nv
        if self._lower is None:
            self._lower = np.empty((self.chunked.count * self.layout.chunk, width, nv, nv))
        gradient = np.empty((self.chunked.count * self.layout.chunk, nv))
        compact: list[tuple[np.ndarray, ...]] = []
        lower = self._lower[: self.frames]
        border = Border(self.layout, compact, self.frames) if self.layout.use_border else None
        m = self.layout.constants
        corner, slope, cost = np.zeros((m, m)), np.zeros(m), 0.0
        for i, (out, spread) in enumerate(self._systems(state, spread=follow is not None)):
            rows = slice(i * self.layout.chunk, (i + 1) * self.layout.chunk)
            self._lower[rows] = out.lower
            gradient[rows] = out.gradient
            cost += float(out.cost)
            if border is not None:
                add_chunk(out, corner, slope)
                compact.append(tuple(np.asarray(x) for x in out.border_parts))
                if spread is not None:
                    border.prepare(i, spread)
            if follow is not None:
                follow(lower, border, min(rows.stop, self.frames))
        gradient = gradient[: self.frames]
        if not self.layout.use_border:
            return NormalEquations(cost, lower, gradient, None, np.zeros(0), None)
        prior_cost, prior_slope, prior_square = self._prior(state.constants)
        return NormalEquations(
            cost + prior_cost, lower, gradient, corner + prior_square, slope + prior_slope, border
        )

    def factorised(self, state: State) -> tuple[NormalEquations, linalg.ArrowFactor]:
        """Normal equations at a state and their factor.

        In single precision, rounding can exceed what weakly determined poses have; then as little
        damping as works is added.

        Raises:
            SolveError: the equations are singular in double precision.
        """
        dampings = (0.0,) if self.dtype == np.float64 else (0.0, 1e0, 1e2, 1e4, 1e6)
        for damping in dampings[:-1]:
            try:
                return self._factorised(state, damping)
            except SolveError:
                continue
        return self._factorised(state, dampings[-1])

    def _factorised(
        self, state: State, damping: float
    ) -> tuple[NormalEquations, linalg.ArrowFactor]:
        factoring: list[linalg.Factoring] = []

        def follow(lower: np.ndarray, border: linalg.BorderBlocks | None, ready: int) -> None:
            if not factoring:
                factoring.append(linalg.Factoring(lower, border, damping=damping, overwrite=True))
            factoring[0].advance(ready)

        e = self.linearise(state, follow)
        return e, factoring[0].finish(e.corner)

    def _systems(
        self, state: State, *, spread: bool
    ) -> Iterator[tuple[ChunkSystem, jax.Array | None]]:
        """Chunk systems in order, and their border blocks if they are to be spread out.

        The next one is computed while the caller uses this one; border blocks are asked for before
        that, or they would queue behind it.
        """
        pending: list[tuple[ChunkSystem, jax.Array | None]] = []
        for arguments in self._inputs(state):
            out = assemble_chunk(self.layout, *arguments, self.weights)
            wanted = spread and self.layout.use_border
            pending.append((out, chunk_border(self.layout, *out.border_parts) if wanted else None))
            if len(pending) > 1:
                yield pending.pop(0)
        yield from pending

    def move(
        self, state: State, step: Float[np.ndarray, "t nv"], constants: Float[np.ndarray, "m"]
    ) -> State:
        """The state after a step in the tangent space."""
        q = np.asarray(self._retract(jnp.asarray(state.q), jnp.asarray(step)))
        if not self.layout.use_border:
            return State(q, state.constants)
        moved = moved_constants(self.layout, state.constants, jnp.asarray(constants))
        return State(q, jax.tree.map(np.asarray, moved))

    def _prior(self, constants: Constants) -> tuple[float, np.ndarray, np.ndarray]:
        """Cost, gradient (m,) and curvature (m, m) of what is known of the constants besides."""
        m = self.layout.constants
        if not self.layout.use_border:
            return 0.0, np.zeros(m), np.zeros((m, m))
        return prior_equations(constants, self.prior_information, self.readings, self.mixing)

    def model(
        self, state: State, x: np.ndarray, z: np.ndarray, *, offset: bool, damping: float = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """J'(r + J (x, z)) plus damping times (x, z), from J itself; without r if not `offset`."""
        inputs = self._inputs(state)
        g, gz = model_gradient(self.layout, inputs, self.weights, x, z, offset=offset)
        if self.layout.use_border:
            _, prior, square = self._prior(state.constants)
            gz = gz + square @ z + offset * prior
        return g + damping * x, gz + damping * z

    def gate(self, state: State) -> np.ndarray:
        """The gate w_a of every range at a state, (t, k)."""
        parts = [np.asarray(v.gate) for v in self._values(state)]
        return np.concatenate(parts)[: self.frames]

    def residuals(self, state: State) -> dict[str, np.ndarray]:
        """Plain measurement residuals by kind, (t, s, 3) and (t, k)."""
        parts = [v.residuals for v in self._values(state)]
        return {
            kind: np.concatenate([np.asarray(p[kind]) for p in parts])[: self.frames]
            for kind in parts[0]
        }

"""`differentiable_ekf`: the filter as a function that JAX differentiates, likelihood included."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.estimate.filter_frame import filter_frame
from mocap_jax.estimate.filter_model import FilterModel, FrameInput, Parameters
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.estimate.filter_run import prepare
from mocap_jax.estimate.inputs import body_of, uses_root
from mocap_jax.initialise import rest_pose
from mocap_jax.kalman import State
from mocap_jax.recording import Recording


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class FilterMeasurements:
    """Readings as the filter takes them, biases of the rest hold removed; NaN where missing."""

    accelerometer: Float[Array, "t s 3"]
    gyroscope: Float[Array, "t s 3"]
    orientation: Float[Array, "t s 4"]
    range_distance: Float[Array, "t k"]
    root_position: Float[Array, "t 3"]
    root_orientation: Float[Array, "t 4"]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class FilterParameters:
    """All that the filter can be differentiated by."""

    measurements: FilterMeasurements
    noise: Parameters
    """Dynamics and standard deviations."""
    start: State
    """Belief at the first frame."""
    body: Body
    """With the mountings that the rest hold showed."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class FilterEstimate:
    """What the filter says for some parameters."""

    q: Float[Array, "t nq"]
    """Poses."""
    v: Float[Array, "t nv"]
    """Velocities [rad/s, m/s]."""
    covariance: Float[Array, "t nv nv"]
    """Marginal of each pose."""
    log_likelihood: Float[Array, ""]
    """Of all innovations: what noise figures are tuned by."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class _Fixed:
    valid: Bool[Array, "c n"]
    first: Bool[Array, "c n"]
    range_weight: Float[Array, "c n k"]
    range_source: Int[Array, "c n k"]
    range_receiver: Int[Array, "c n k"]
    range_lead: Float[Array, "c n k"]
    magnetic: Float[Array, "c n s 3"]
    gravity: Float[Array, "c n s 3"] | tuple[()] = ()


class DifferentiableFilter:
    """The filter as a function of `FilterParameters`; which readings exist is held."""

    def __init__(
        self, parameters: FilterParameters, model: FilterModel, fixed: _Fixed, time: np.ndarray
    ) -> None:
        self.parameters = parameters
        """Parameters of the recording and the options."""
        self.time = time
        """(t,) [s]"""
        self._model, self._fixed = model, fixed
        self._run = jax.jit(self._filter)

    def __call__(self, parameters: FilterParameters) -> FilterEstimate:
        """Filter with other parameters."""
        return self._run(parameters)

    def _filter(self, p: FilterParameters) -> FilterEstimate:
        nv, t = p.body.nv, len(self.time)

        @jax.checkpoint
        def chunk(state: State, frames: FrameInput) -> tuple[State, tuple]:
            return jax.lax.scan(step, state, frames)

        @jax.checkpoint
        def step(state: State, frame: FrameInput) -> tuple[State, tuple]:
            state, seen = filter_frame(p.body, self._model, p.noise, state, frame)
            told = sum((i.log_likelihood for i in seen.values()), jnp.zeros(()))
            marginal = state.covariance[:nv, :nv]
            return state, (state.q, state.v, marginal, jnp.where(frame.valid, told, 0.0))

        _, out = jax.lax.scan(chunk, p.start, self._frames(p.measurements))
        q, v, covariance, told = (x.reshape(-1, *x.shape[2:])[:t] for x in out)
        return FilterEstimate(q, v, covariance, told.sum())

    def _frames(self, m: FilterMeasurements) -> FrameInput:
        fixed = self._fixed
        chunks, size = fixed.valid.shape
        pad = chunks * size - len(self.time)

        def cut(x: Array) -> Array:
            widths = [(0, pad)] + [(0, 0)] * (x.ndim - 1)
            return jnp.pad(jnp.asarray(x), widths).reshape(chunks, size, *x.shape[1:])

        return FrameInput(
            fixed.valid, fixed.first, cut(m.accelerometer), cut(m.gyroscope), cut(m.orientation),
            cut(m.range_distance), fixed.range_weight, fixed.range_source, fixed.range_receiver,
            fixed.range_lead, cut(m.root_position), cut(m.root_orientation), fixed.magnetic,
            fixed.gravity,
        )  # fmt: skip


def differentiable_ekf(
    recording: Recording,
    body: Body | None = None,
    *,
    options: EkfOptions = EkfOptions(),  # noqa: B008  (frozen)
) -> DifferentiableFilter:
    """The extended Kalman filter as a differentiable function of readings, noise and body.

    The derivative is that of every step the filter takes, exact; the backward pass computes
    chunks of frames again, so that memory holds one chunk's beliefs.

    Args:
        recording: measured streams and their set-up.
        body: nominal body; default the recording's own.
        options: see `EkfOptions`; the smoother is not part of it.

    Raises:
        InputError: as `ekf`, or `options.smooth`.

    Example:
        filtered = mj.differentiable_ekf(recording)
        slope = jax.grad(lambda p: filtered(p).log_likelihood)(filtered.parameters)
        slope.noise.gyroscope_sigma
    """
    if options.smooth:
        raise InputError("smooth=True: the differentiable filter has no smoother; use smooth=False")
    body = body_of(recording, body)
    use_root = uses_root(recording, options.root)
    rest = rest_pose(recording, body, options=options.rest, use_root=use_root)
    run = prepare(recording, body, options, rest, use_root)
    chunks = jax.tree.map(lambda *x: jnp.stack([jnp.asarray(a) for a in x]), *run.chunks)
    t = len(run.time)
    # Not `reshape` to -1, which no array without entries has: nothing was ranged.
    flat = {
        name: jnp.concatenate(list(getattr(chunks, name)))[:t]
        for name in FilterMeasurements.__dataclass_fields__
    }
    parameters = FilterParameters(FilterMeasurements(**flat), run.parameters, run.start, run.body)
    fixed = _Fixed(**{name: getattr(chunks, name) for name in _Fixed.__dataclass_fields__})
    return DifferentiableFilter(parameters, run.model, fixed, run.time)

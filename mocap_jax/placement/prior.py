"""Information that the estimator has of a motion before any sensor is put on.

It comes from the estimator's own equations, assembled at the true motion without measurements:
smoothness, weak pose prior, joint limits, declared rest hold, and the root if it is given.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, difference
from mocap_jax.errors import InputError
from mocap_jax.estimate import ConstantsOptions, OptimiseOptions, PriorOptions
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.layout import Terms
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.estimate.sequence.terms import build
from mocap_jax.measurement import FrameData
from mocap_jax.placement.options import ErrorModel, PlacementOptions
from mocap_jax.recording import NoiseFigures, RestHold, SensorSpec, Setup

_NO_CONSTANTS = ConstantsOptions(
    gyroscope_bias_sigma=0.0, accelerometer_bias_sigma=0.0, mounting_sigma=0.0, offset_sigma=0.0
)


@dataclass(frozen=True)
class Prior:
    """Normal equations of the priors at the true motion."""

    lower: Float[np.ndarray, "t 3 nv nv"]
    """[k, o]: block (k + o, k)."""
    pull: Float[np.ndarray, "t nv"]
    """Gradient: how the priors pull the estimate away from the truth."""


@dataclass(frozen=True)
class Habits:
    """How far and how fast people move each degree of freedom: a stationary process.

    Its spectrum 1 / (1 / size + omega^4 / density) is that of the estimator's weak pose prior and
    smoothness together; variance and mean squared speed decide both figures.
    """

    size: Float[np.ndarray, "nv"]
    """[rad^2 s]"""
    density: Float[np.ndarray, "nv"]
    """Of acceleration [rad^2/s^3]."""


# Degrees of freedom that hardly move are still not known better than this [rad], nor slower [1/s].
_LEAST, _SLOWEST = 0.03, 1.0


def habits_of(body: Body, poses: tuple[np.ndarray, ...], step: float) -> Habits:
    """Habits that the motions of a study show, all together.

    Args:
        body: who moves.
        poses: of each motion (t, nq), without rest hold.
        step: between frames [s].
    """
    topology, reference = body.topology, jnp.asarray(np.array(body.qpos0))
    away = jax.jit(jax.vmap(lambda q: difference(topology, reference, q)))
    along = jax.jit(jax.vmap(lambda a, b: difference(topology, a, b)))
    offsets = [np.asarray(away(jnp.asarray(q))) for q in poses]
    speeds = [np.asarray(along(jnp.asarray(q[:-1]), jnp.asarray(q[1:]))) / step for q in poses]
    variance = (np.concatenate(offsets) ** 2).mean(0) + _LEAST**2
    speed = (np.concatenate(speeds) ** 2).mean(0) + (_LEAST * _SLOWEST) ** 2
    corner = np.sqrt(speed / variance)
    size = np.sqrt(8.0) * variance / corner
    return Habits(size, size * corner**4)


def prior_of(
    body: Body, q: np.ndarray, time: np.ndarray, rest: RestHold, options: PlacementOptions,
    habits: Habits | None = None,
) -> Prior:  # fmt: skip
    """Assemble the priors of one motion.

    Args:
        body: with at least one site.
        q: true poses (t, nq).
        time: of the frames [s].
        rest: declared rest hold.
        options: of the study.
        habits: stand in for the estimator's pose prior and smoothness.
    """
    if not body.topology.site_names:
        raise InputError("the body has no sensor sites")
    step, errors = float(time[1] - time[0]), options.errors
    setup = Setup(
        sensors=(SensorSpec("board", body.topology.site_names[0], errors.rate_hz),),
        noise=on_grid(errors, step), rest=rest,
    )  # fmt: skip
    built = build(
        _no_readings(q, time), body, setup, estimator_options(options),
        root_given=options.root == "given",
    )  # fmt: skip
    # Nothing is measured: a smaller program.
    layout = dataclasses.replace(built.layout, use_acceleration=False, use_rate=False)
    terms = built.terms if habits is None else _with_habits(built.terms, body, habits, step)
    problem = SequenceProblem(layout, body, terms, built.weights, np.zeros(0))
    equations = problem.linearise(State(q, _no_constants()))
    return Prior(np.array(equations.lower), np.array(equations.gradient))


def _with_habits(terms: Terms, body: Body, habits: Habits, step: float) -> Terms:
    joints = np.arange(6 if body.has_free_root else 0, body.nv)
    reference = np.array(terms.reference_information)
    smooth = np.array(terms.smoothness_information)
    reference[1][:, joints] = step / habits.size[joints]
    inside = smooth[:, joints] > 0
    smooth[:, joints] = np.where(inside, step / habits.density[joints], 0.0)
    return dataclasses.replace(
        terms, reference_information=reference, smoothness_information=smooth
    )


def estimator_options(options: PlacementOptions) -> OptimiseOptions:
    """The optimiser's options that correspond to a study's."""
    prior: PriorOptions = dataclasses.replace(
        options.errors.prior,
        smoothness_density=options.motion_density,
        shared_smoothness_density=options.motion_density,
        smoothness_order=2,
    )
    return OptimiseOptions(kinds="AG", constants=_NO_CONSTANTS, prior=prior)


def on_grid(errors: ErrorModel, step: Any) -> NoiseFigures:
    """White noise of means over a grid step, from that of samples."""
    factor = (errors.rate_hz * step) ** -0.5
    noise = errors.noise
    return dataclasses.replace(
        noise,
        **{
            f.name: getattr(noise, f.name) * factor
            for f in dataclasses.fields(noise)
            if f.name not in ("range", "magnetometer")
        },
    )


def _no_readings(q: np.ndarray, time: np.ndarray) -> FrameData:
    """A frame grid with the true root and readings whose values do not matter."""
    t = len(time)
    none, empty = np.zeros((t, 1, 3)), np.zeros((t, 0))
    index = np.zeros((t, 0), int)
    return FrameData(
        time, np.asarray(time[1] - time[0]), none, none, np.full((t, 1, 4), np.nan),
        empty, empty, index, index, empty, q[:, :3], q[:, 3:7], ("board",), (0,), "AG",
    )  # fmt: skip


def _no_constants() -> Constants:
    zero = np.zeros((1, 3))
    return Constants(zero, zero, np.eye(3)[None], zero)

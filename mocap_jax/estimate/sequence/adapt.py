"""Noise levels from the recording itself: variance components of every stream and prior.

A data sheet's white noise is not what limits a body-worn sensor (soft tissue, lever arms, wrong
segment lengths are). After a solve, the variance of each group of residuals is re-estimated as
sum r^2 / sum (1 - leverage) (Helmert 1924; MacKay 1992 for the priors): dividing by the
redundancy makes up for what the fit has absorbed. Leverages come from one draw of the posterior,
whose image in the residuals has them as its variance.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from mocap_jax import linalg
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.estimate.sequence.layout import Terms
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.residuals.robust import weight

# The step, in posterior deviations, of the finite difference that maps a draw to residuals.
_PROBE = 1e-2
# A group never takes less than this share of the redundancy (keeps the ratio finite).
_LEAST_REDUNDANCY = 0.02
_INERTIAL = ("accelerometer", "gyroscope", "orientation")
_FIELD = {"accelerometer": "force", "gyroscope": "rate", "orientation": "orientation"}


@dataclass(frozen=True)
class NoiseLevels:
    """Factors on declared standard deviations, by group; and the priors' deviations."""

    inertial: dict[str, np.ndarray]
    """Kind -> factor per sensor (s,), at least 1."""
    range: np.ndarray
    """Factor per receiver, by position in the layout's range sites; at least 1."""
    gyroscope_bias: float
    accelerometer_bias: float
    mounting: float
    rest: float
    extra: dict[str, float] = field(default_factory=dict)


def initial_levels(options: OptimiseOptions, sensors: int, range_sites: int) -> NoiseLevels:
    """Declared noise, and the priors of the options."""
    c = options.constants
    return NoiseLevels(
        {kind: np.ones(sensors) for kind in _INERTIAL},
        np.ones(max(range_sites, 1)),
        c.gyroscope_bias_sigma,
        c.accelerometer_bias_sigma,
        c.mounting_sigma,
        options.prior.rest_sigma,
    )


def prior_information(levels: NoiseLevels, sensors: int) -> np.ndarray:
    """Inverse variances of the sensors' constants (s, 9); a zero deviation pins the constant."""
    sigma = np.repeat([levels.gyroscope_bias, levels.accelerometer_bias, levels.mounting], 3)
    return np.tile(1 / np.maximum(sigma, 1e-7) ** 2, (sensors, 1))


def scaled_terms(
    terms: Terms, gate: np.ndarray | None, levels: NoiseLevels, options: OptimiseOptions,
    rest: np.ndarray, free: int,
) -> dict[str, np.ndarray]:  # fmt: skip
    """Information arrays under other noise levels.

    Args:
        terms: under declared noise.
        gate: w_a of every range, or None.
        levels: factors.
        options: declared priors.
        rest: frames of the rest hold.
        free: number of root degrees of freedom (not touched by the rest prior).
    """
    out = {}
    for kind, scale in levels.inertial.items():
        name = f"{_FIELD[kind]}_information"
        out[name] = getattr(terms, name) / scale**2
    if gate is not None:
        out["range_information"] = (
            terms.range_information * gate / levels.range[terms.range_receiver] ** 2
        )
    if len(rest):
        info = np.array(terms.reference_information)
        info[0][np.ix_(rest, np.arange(free, info.shape[2]))] = 1 / (levels.rest**2 * len(rest))
        out["reference_information"] = info
    return out


def re_estimate(
    problem: SequenceProblem,
    state: State,
    terms: Terms,
    changed: dict[str, np.ndarray],
    levels: NoiseLevels,
    options: OptimiseOptions,
    rest: np.ndarray,
    generator: np.random.Generator,
) -> NoiseLevels:
    """Variance components at a solution.

    Args:
        problem: as solved.
        state: its solution.
        terms: under declared noise.
        changed: the information arrays the problem was solved with.
        levels: the noise levels it was solved with.
        options: of the optimiser.
        rest: frames of the rest hold.
        generator: for the posterior draw.
    """
    equations = problem.linearise(state)
    f = linalg.factor(equations.lower, equations.corner, equations.border, overwrite=True)
    step, constants = linalg.sample(f, equations.border, generator)
    here = problem.residuals(state)
    ahead = problem.residuals(problem.move(state, _PROBE * step, _PROBE * constants))
    image = {kind: (ahead[kind] - here[kind]) / _PROBE for kind in here}
    inertial = dict(levels.inertial)
    if options.noise.adapt:
        for kind in _INERTIAL:
            info = changed[f"{_FIELD[kind]}_information"]
            factor = _inertial_factor(here[kind], image[kind], info, options)
            inertial[kind] = np.maximum(levels.inertial[kind] * factor, 1.0)
    ranged = levels.range
    if options.noise.adapt and "range" in here:
        ranged = _range_factors(here["range"], image["range"], changed, terms, levels)
    levels = dataclasses.replace(levels, inertial=inertial, range=ranged)
    if options.constants.adapt and problem.layout.use_border:
        levels = _constants(problem, state, f, levels)
    if options.noise.adapt and len(rest):
        levels = dataclasses.replace(levels, rest=_rest(problem, state, step, terms, levels, rest))
    return levels


def _inertial_factor(
    residual: np.ndarray, image: np.ndarray, info: np.ndarray, options: OptimiseOptions
) -> np.ndarray:
    """Ratio of found to assumed standard deviation, per sensor."""
    squared = info * (residual**2).sum(-1)
    loss, scale = options.noise.inertial_loss, options.noise.inertial_scale
    robust = np.asarray(weight(loss, squared, scale))
    leverage = (info * (image**2).sum(-1)).sum(0)
    count = 3.0 * (info > 0).sum(0)
    redundancy = np.maximum(count - leverage, _LEAST_REDUNDANCY * count)
    ratio = (robust * squared).sum(0) / np.maximum(redundancy, 1e-9)
    return np.where(count > 0, np.sqrt(ratio), 1.0)


def _range_factors(
    residual: np.ndarray,
    image: np.ndarray,
    changed: dict[str, np.ndarray],
    terms: Terms,
    levels: NoiseLevels,
) -> np.ndarray:
    """Noise factors per receiver; the median keeps multipath out."""
    info = changed["range_information"]
    whitened, leverage = np.sqrt(info) * residual, info * image**2
    out = np.array(levels.range)
    for site in np.unique(terms.range_receiver[info > 0]):
        chosen = (terms.range_receiver == site) & (info > 0)
        redundancy = max(1 - leverage[chosen].mean(), _LEAST_REDUNDANCY)
        spread = np.median(np.abs(whitened[chosen])) / 0.6745
        out[site] = max(levels.range[site] * spread / np.sqrt(redundancy), 1.0)
    return out


def _constants(
    problem: SequenceProblem, state: State, f: linalg.ArrowFactor, levels: NoiseLevels
) -> NoiseLevels:
    """Deviations of the sensors' constants as a population: sum v^2 / sum (1 - var / sigma^2)."""
    variance = np.diag(linalg.corner_covariance(f)).reshape(-1, 9)
    values = constant_values(state)
    names = ("gyroscope_bias", "accelerometer_bias", "mounting")
    changes = {}
    for i, name in enumerate(names):
        sigma = getattr(levels, name)
        if not sigma:
            continue
        cells = slice(3 * i, 3 * i + 3)
        determined = (1 - variance[:, cells] / sigma**2).clip(0).sum()
        least = _LEAST_REDUNDANCY * variance[:, cells].size
        found = (values[:, cells] ** 2).sum() / max(determined, least)
        changes[name] = float(np.clip(np.sqrt(found), 1e-3 * sigma, 10 * sigma))
    return dataclasses.replace(levels, **changes)


def constant_values(state: State) -> np.ndarray:
    """Sensors' constants as (s, 9): gyroscope bias, accelerometer bias, mounting rotation vector."""
    from mocap_jax import so3

    c = state.constants
    return np.concatenate(
        [c.gyroscope_bias, c.accelerometer_bias, np.asarray(so3.log(np.asarray(c.mounting)))], 1
    )


def _rest(
    problem: SequenceProblem,
    state: State,
    step: np.ndarray,
    terms: Terms,
    levels: NoiseLevels,
    rest: np.ndarray,
) -> float:
    """How far people are from their declared rest pose, per coordinate [rad]."""
    from mocap_jax.body import difference

    first = 6 if problem.body.has_free_root else 0
    middle = rest[len(rest) // 2]
    offset = np.asarray(
        difference(problem.layout.topology, terms.reference[0, middle], state.q[middle])
    )[first:]
    leverage = (step[rest].mean(0)[first:] ** 2).sum() / levels.rest**2
    redundancy = max(len(offset) - leverage, _LEAST_REDUNDANCY * len(offset))
    found = float(np.sqrt((offset**2).sum() / redundancy))
    return float(np.clip(found, 1e-3 * levels.rest, 10 * levels.rest))

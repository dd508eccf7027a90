"""Noise levels from the recording itself: variance components of every stream and prior.

A data sheet's white noise is not what limits a body-worn sensor (soft tissue, lever arms, wrong
segment lengths are). After a solve, the variance of each group of residuals is re-estimated as
sum r^2 / sum (1 - leverage) (Helmert 1924; MacKay 1992 for the priors): dividing by the
redundancy makes up for what the fit has absorbed. Leverages come from a few draws of the
posterior, whose images in the residuals have them as their variance.

These errors are not white. Soft tissue wobbles: its error in the rate sums to almost nothing.
Wrong lengths stay: their error in a range does not average out. What the sequence needs is the
level at low frequency, so the sums are taken over blocks of successive residuals; the plain RMS
only sets where a residual counts as an outlier.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

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
_DRAWS = 4
# Lengths of the blocks over which residuals are summed [s].
_INERTIAL_BLOCK = 0.5
_RANGE_BLOCK = 1.0
_INERTIAL = ("accelerometer", "gyroscope", "orientation")
_FIELD = {"accelerometer": "force", "gyroscope": "rate", "orientation": "orientation"}


@dataclass(frozen=True)
class NoiseLevels:
    """Factors on declared standard deviations, by group; and the priors' deviations."""

    inertial: dict[str, np.ndarray]
    """Kind -> low-frequency factor per sensor (s,), at least 1."""
    spread: dict[str, np.ndarray]
    """Kind -> RMS of single residuals over the low-frequency level, per sensor, at least 1."""
    range: np.ndarray
    """Factor per receiver, by position in the layout's range sites; at least 1."""
    range_spread: np.ndarray
    """Median size of single range residuals over that level, at most 1."""
    gyroscope_bias: float
    accelerometer_bias: float
    mounting: float
    rest: float


def initial_levels(options: OptimiseOptions, sensors: int, range_sites: int) -> NoiseLevels:
    """Declared noise, and the priors of the options."""
    c, noise = options.constants, options.noise
    start = {
        "accelerometer": noise.initial_accelerometer_factor,
        "gyroscope": noise.initial_gyroscope_factor,
        "orientation": 1.0,
    }
    adapted = {k: np.full(sensors, f if noise.adapt else 1.0) for k, f in start.items()}
    ranges = np.full(max(range_sites, 1), noise.initial_range_factor if noise.adapt else 1.0)
    return NoiseLevels(
        adapted,
        {kind: np.ones(sensors) for kind in _INERTIAL},
        ranges,
        np.ones_like(ranges),
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


def loss_scales(levels: NoiseLevels, options: OptimiseOptions) -> np.ndarray:
    """Outlier thresholds (3, s) of accelerations, rates and orientations [deviations]."""
    return options.noise.inertial_scale * np.stack([levels.spread[k] for k in _INERTIAL])


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
    draws = [linalg.sample(f, equations.border, generator) for _ in range(_DRAWS)]
    here = problem.residuals(state)
    images: dict[str, list[np.ndarray]] = {kind: [] for kind in here}
    for step, constants in draws:
        ahead = problem.residuals(problem.move(state, _PROBE * step, _PROBE * constants))
        for kind in here:
            images[kind].append((ahead[kind] - here[kind]) / _PROBE)
    if options.noise.adapt:
        block = max(1, round(_INERTIAL_BLOCK / float(problem.weights.step)))
        inertial, spread = dict(levels.inertial), dict(levels.spread)
        for kind in _INERTIAL:
            info = changed[f"{_FIELD[kind]}_information"]
            slow, single = _inertial_factors(here[kind], images[kind], info, block, levels, kind, options)
            inertial[kind] = np.maximum(levels.inertial[kind] * slow, 1.0)
            total = levels.inertial[kind] * single
            spread[kind] = np.maximum(total / inertial[kind], 1.0)
        levels = dataclasses.replace(levels, inertial=inertial, spread=spread)
        if "range" in here:
            levels = _ranges(problem, here["range"], images["range"], changed, terms, levels)
        if len(rest):
            found = _rest(problem, state, draws, terms, levels, rest)
            levels = dataclasses.replace(levels, rest=min(found, options.prior.rest_sigma))
    if options.constants.adapt and problem.layout.use_border:
        levels = _constants(problem, state, f, levels, options)
    return levels


def _inertial_factors(
    residual: np.ndarray,
    images: list[np.ndarray],
    info: np.ndarray,
    block: int,
    levels: NoiseLevels,
    kind: str,
    options: OptimiseOptions,
) -> tuple[np.ndarray, np.ndarray]:
    """Ratios of found to assumed deviation per sensor: of block sums, of single residuals."""
    squared = info * (residual**2).sum(-1)
    scale = options.noise.inertial_scale * levels.spread[kind]
    robust = np.asarray(weight(options.noise.inertial_loss, squared, scale))
    root = np.sqrt(info * robust)[..., None]
    images_whitened = [root * x for x in images]
    slow = _pooled(
        _block_squares(root * residual, block),
        np.mean([_block_squares(x, block) for x in images_whitened], axis=0),
        _block_squares(np.ones_like(residual) * (info > 0)[..., None], block) > 0,
    )
    count = 3.0 * (info > 0).sum(0)
    leverage = np.mean([(x**2).sum((0, 2)) for x in images_whitened], axis=0)
    redundancy = np.maximum(count - leverage, _LEAST_REDUNDANCY * count)
    single = (robust * squared).sum(0) / np.maximum(redundancy, 1e-9)
    return np.where(count > 0, slow, 1.0), np.where(count > 0, np.sqrt(single), 1.0)


def _block_squares(whitened: np.ndarray, block: int) -> np.ndarray:
    """Squares of block sums over root count, (blocks, s, 3); variance 1 where white."""
    t, s, _ = whitened.shape
    blocks = -(-t // block)
    padded = np.zeros((blocks * block, s, 3))
    padded[:t] = whitened
    return padded.reshape(blocks, block, s, 3).sum(1) ** 2 / block


def _pooled(squares: np.ndarray, leverage: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Root of sum squares / sum redundancy per sensor, drawn towards that of all sensors."""
    found, count = squares.sum((0, 2)), used.sum((0, 2)).astype(float)
    redundancy = np.maximum(count - leverage.sum((0, 2)), _LEAST_REDUNDANCY * count)
    if not count.any():
        return np.ones(len(count))
    common = found.sum() / redundancy.sum()
    prior = 0.25 * redundancy.sum() / max((count > 0).sum(), 1)
    return np.sqrt((found + prior * common) / (redundancy + prior))


def _ranges(
    problem: SequenceProblem,
    residual: np.ndarray,
    images: list[np.ndarray],
    changed: dict[str, np.ndarray],
    terms: Terms,
    levels: NoiseLevels,
) -> NoiseLevels:
    """Noise factors per receiver, from block means of every source-receiver pair.

    Medians keep multipath out; the square of a normal variable has the median 0.455.
    """
    info = changed["range_information"]
    used = info > 0
    block = max(1, round(_RANGE_BLOCK / float(problem.weights.step)))
    rows = np.broadcast_to(np.arange(len(info))[:, None] // block, info.shape)[used]
    receiver, source = terms.range_receiver[used], terms.range_source[used]
    root = np.sqrt(info[used])
    limit = 3.0 * levels.range_spread[receiver]
    whitened = np.clip(root * residual[used], -4 * limit, 4 * limit)
    key = (rows * 1000 + source) * 1000 + receiver
    pairs, place, count = np.unique(key, return_inverse=True, return_counts=True)
    total = lambda x: np.bincount(place, x, len(pairs)) ** 2 / count  # noqa: E731
    squares = total(whitened)
    leverage = np.mean([total(root * x[used]) for x in images], axis=0)
    factor, spread = np.array(levels.range), np.array(levels.range_spread)
    for site in np.unique(receiver):
        mine = (pairs % 1000) == site
        redundancy = max(1 - leverage[mine].mean(), _LEAST_REDUNDANCY)
        slow = np.sqrt(np.median(squares[mine]) / 0.455 / redundancy)
        single = np.median(np.abs(whitened[receiver == site])) / 0.6745
        factor[site] = max(levels.range[site] * slow, 1.0)
        spread[site] = np.clip(levels.range[site] * single / factor[site], 0.1, 1.0)
    return dataclasses.replace(levels, range=factor, range_spread=spread)


def _constants(
    problem: SequenceProblem,
    state: State,
    f: linalg.ArrowFactor,
    levels: NoiseLevels,
    options: OptimiseOptions,
) -> NoiseLevels:
    """Deviations of the sensors' constants as a population: sum v^2 / sum (1 - var / sigma^2).

    They may shrink to what the recording shows, not grow beyond the declared prior: a misfit
    elsewhere would otherwise be blamed on them without bound.
    """
    variance = np.diag(linalg.corner_covariance(f)).reshape(-1, 9)
    values = constant_values(state)
    c = options.constants
    declared = (c.gyroscope_bias_sigma, c.accelerometer_bias_sigma, c.mounting_sigma)
    changes = {}
    for i, name in enumerate(("gyroscope_bias", "accelerometer_bias", "mounting")):
        sigma = getattr(levels, name)
        if not sigma:
            continue
        cells = slice(3 * i, 3 * i + 3)
        determined = (1 - variance[:, cells] / sigma**2).clip(0).sum()
        least = _LEAST_REDUNDANCY * variance[:, cells].size
        found = np.sqrt((values[:, cells] ** 2).sum() / max(determined, least))
        changes[name] = float(np.clip(found, 1e-3 * declared[i], declared[i]))
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
    draws: list[tuple[np.ndarray, np.ndarray]],
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
    images = [step[rest].mean(0)[first:] for step, _ in draws]
    leverage = np.mean([(x**2).sum() for x in images]) / levels.rest**2
    redundancy = max(len(offset) - leverage, _LEAST_REDUNDANCY * len(offset))
    found = float(np.sqrt((offset**2).sum() / redundancy))
    return float(np.clip(found, 1e-3 * levels.rest, 10 * levels.rest))

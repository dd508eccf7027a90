"""How wrong the measurements really are: model errors and priors learnt from the recording.

A data sheet's white noise is not what limits a body-worn sensor: soft tissue, lever arms, clocks
and wrong segment lengths are. Every measurement kind therefore has a model-error term beside its
declared noise, variance = declared^2 + model^2. The recording may show that it is cleaner than
that (a rig, a simulation): after a solve the excess of the residuals over the declared noise is
found as a variance component, sum r^2 / sum (1 - leverage) (Helmert 1924; for the priors of the
sensors' constants, MacKay 1992), and the model error is lowered to `excess_margin` times it. The
margin is there because the poses follow most of such errors: they show in part only. Where most
sensors are as good as declared, the others have no margin either.

Leverages come from a few draws of the posterior, whose images in the residuals have them as their
variance.
"""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np

from mocap_jax import linalg
from mocap_jax.body import difference, joint_dofs
from mocap_jax.estimate.sequence.corner import constant_values
from mocap_jax.estimate.sequence.layout import Layout
from mocap_jax.estimate.sequence.levels import (
    CORRECTION_KINDS,
    GEOMETRY_KINDS,
    INFORMATION,
    Levels,
    constant_cells,
    declared_deviations,
    mostly_wrong,
    prior_counts,
    prior_from,
    repeats,
)
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.estimate.sequence.terms import Built
from mocap_jax.estimate.whole_sequence_options import ConstantsOptions, OptimiseOptions
from mocap_jax.residuals.robust import weight

# The step, in posterior deviations, of the finite difference that maps a draw to residuals.
_PROBE = 1e-2
# A group never takes less than this share of the redundancy (keeps the ratio finite).
_LEAST_REDUNDANCY = 0.02
# Inertial readings that the poses follow almost freely (a pelvis whose measured root is coarse)
# show how far the motion is from its prior, not how wrong they are: they count as they are.
_LEAST_INERTIAL_REDUNDANCY = 0.25
_DRAWS = 2
# Excess variance, relative to the declared one, that is no model error: readings that are hardly
# weighted show the noise of the poses beside their own.
_CHANCE = 2.0
# Ranges, thousands of whose residuals are read together, show a smaller one.
_RANGE_CHANCE = 0.2
# Constants beyond this many declared deviations are not believed.
_FAR = 3.0
# Times that deviations of constants are found anew from one solution.
_INNER = 2
# Fewer constants than this say little about the size of their kind.
_FEW = 6
_PATIENT = (*GEOMETRY_KINDS, *CORRECTION_KINDS)
# Ranges whose declared variance is below this many times the smallest count as trusted.
_TRUSTED = 4.0


def re_estimate(
    problem: SequenceProblem,
    state: State,
    built: Built,
    current: dict[str, np.ndarray],
    levels: Levels,
    options: OptimiseOptions,
    generator: np.random.Generator,
) -> Levels:
    """Levels as the residuals of a solution show them; never above the options' figures.

    Args:
        problem: as solved.
        state: its solution.
        built: the problem's arrays.
        current: the information arrays the problem was solved with.
        levels: the levels it was solved with.
        options: of the optimiser.
        generator: for the posterior draws.
    """
    often = repeats(options, problem.frames)
    equations, f = problem.factorised(state)
    draws = [linalg.sample(f, equations.border, generator) for _ in range(_DRAWS)]
    here = problem.residuals(state)
    ahead = [problem.residuals(problem.move(state, _PROBE * x, _PROBE * z)) for x, z in draws]
    changes: dict = {}
    if options.noise.adapt and options.noise.model_errors:
        share = dict(levels.share)
        for kind in here:
            images = [(a[kind] - here[kind]) / _PROBE for a in ahead]
            info = current[INFORMATION[kind]]
            if (info > 0).any():
                variances = built.variances[kind]
                found = (
                    np.array([_range_excess(here[kind], images, info, variances)])
                    if kind == "range"
                    else _inertial_excess(here[kind], images, info, variances, options)
                )
                share[kind] = _kept(found, options.noise.excess_margin)
        changes["share"] = share
        if len(built.rest_frames):
            counted = often if mostly_wrong(levels, built) else 1.0
            rest = _rest(problem, state, draws, built, levels, counted)
            changes["rest"] = float(
                np.clip(rest, 1e-3 * options.prior.rest_sigma, options.prior.rest_sigma)
            )
    if options.constants.adapt and problem.layout.use_border:
        counts = prior_counts(levels, built, often, last=False)
        changes |= _constants(problem, state, f, levels, counts, options.constants)
    return dataclasses.replace(levels, **changes)


def _kept(found: np.ndarray, margin: float) -> tuple[float, ...]:
    """Shares for the next round: the excess with its margin, at most 1 (and 1 where absent, NaN).

    Where most sensors are as good as declared, the rest has no margin either: boards at the ends of
    limbs, little tied down by others, would otherwise excuse their own excess round after round.
    """
    factor = margin if np.nanmedian(found) > 0 else 1.0
    return tuple(float(x) for x in np.nan_to_num(np.minimum(1.0, factor * found), nan=1.0))


def _inertial_excess(
    residual: np.ndarray,
    images: list[np.ndarray],
    info: np.ndarray,
    variances: tuple[np.ndarray, np.ndarray],
    options: OptimiseOptions,
) -> np.ndarray:
    """Shares of the model error that explain what residuals have beyond the declared noise.

    Per sensor, but not below the median of the sensors: a board that seems perfect among others
    that are not is one whose errors the poses follow. NaN for sensors without such readings.
    """
    total = lambda x: (x**2).sum(-1)  # noqa: E731
    noise, used = options.noise, info > 0
    robust = info * np.asarray(
        weight(noise.inertial_loss, info * total(residual), noise.inertial_scale)
    )
    count = 3 * (robust / np.where(used, info, 1.0)).sum(0)
    leverage = (robust * np.mean([total(x) for x in images], axis=0)).sum(0)
    redundancy = np.maximum(count - leverage, _LEAST_INERTIAL_REDUNDANCY * count)
    present = count > 0
    declared, model = (
        (robust * np.where(used, v, 0.0)).sum(0)[present] / robust.sum(0)[present]
        for v in variances
    )
    # Variances of single residuals: the weighted sum over the weights' share per degree of freedom.
    found = (robust * total(residual)).sum(0)[present] / redundancy[present]
    found *= count[present] / (3 * robust.sum(0)[present])
    excess = np.where(found > (1 + _CHANCE) * declared, (found - declared) / model, 0.0)
    shares = np.full(len(count), np.nan)
    shares[present] = np.sqrt(np.maximum(excess, np.median(excess)).clip(0))
    return shares


def _range_excess(
    residual: np.ndarray,
    images: list[np.ndarray],
    info: np.ndarray,
    variances: tuple[np.ndarray, np.ndarray],
) -> float:
    """The same for ranges, from the median size of the trusted ones (multipath stays out)."""
    declared, model = variances
    trusted = (info > 0) & (declared < _TRUSTED * np.min(declared))
    if not trusted.any():
        return 1.0
    leverage = np.mean([(info * x**2)[trusted].mean() for x in images])
    spread = np.median(np.abs(residual[trusted])) / 0.6745
    found = spread**2 / max(1 - leverage, _LEAST_REDUNDANCY)
    noise = float(np.median(declared[trusted]))
    excess = found - noise if found > (1 + _RANGE_CHANCE) * noise else 0.0
    return float(np.sqrt(excess / model[trusted].mean()))


def _constants(
    problem: SequenceProblem,
    state: State,
    f: linalg.ArrowFactor,
    levels: Levels,
    counts: np.ndarray,
    options: ConstantsOptions,
) -> dict[str, float]:
    """Deviations of each kind of constants, found anew a few times.

    Other deviations move the constants; how far, the Schur complement S of the poses tells: at the
    solution S z = S_data z_data, where S_data = S - prior is what the recording says by itself.
    """
    whole = _undamped(f, problem.prior_information)
    data, pull = (
        whole - np.diag(problem.prior_information),
        whole @ constant_values(state.constants),
    )
    for _ in range(_INNER):
        prior = prior_from(levels, problem.layout, counts)
        covariance = np.linalg.inv(data + np.diag(prior))
        variance = counts * np.diag(covariance)
        found = _deviations(covariance @ pull, variance, problem.layout, levels, options)
        levels = dataclasses.replace(levels, **found)  # type: ignore[arg-type]
    return {name: getattr(levels, name) for name in declared_deviations(options)}


def _undamped(f: linalg.ArrowFactor, prior: np.ndarray) -> np.ndarray:
    """The Schur complement S without the damping of its diagonal, which is nobody's information.

    That of the poses, which only makes S larger, stays in it. Where rounding leaves less than the
    prior, there is the prior.
    """
    whole = f.corner.T @ f.corner
    if not f.damping:
        return whole
    root = np.sqrt(prior)
    values, axes = np.linalg.eigh((whole - f.damping * np.eye(len(prior))) / np.outer(root, root))
    return root[:, None] * ((axes * np.maximum(values, 1.0)) @ axes.T) * root


def _deviations(
    values: np.ndarray, variance: np.ndarray, layout: Layout, levels: Levels,
    options: ConstantsOptions,
) -> dict[str, float]:  # fmt: skip
    """Deviations of each kind of constants as a population: sum v^2 / sum (1 - var / sigma^2).

    Kinds of `Geometry` and `Corrections` that are few, or that the recording hardly determines,
    take the step of expectation-maximisation instead, mean(v^2 + var): the quotient would take
    their prior's pull for a sign that they are small.

    They may shrink to what the recording shows, not grow beyond the declared prior: a misfit
    elsewhere would otherwise be blamed on them without bound.
    """
    changes, cells = {}, constant_cells(layout)
    for name, declared in declared_deviations(options).items():
        sigma, at = getattr(levels, name), cells.get(name, ())
        if not sigma or not len(at):
            continue
        determined = (1 - variance[at] / sigma**2).clip(0).sum()
        if name in _PATIENT and (len(at) < _FEW or 2 * determined < len(at)):
            found = np.sqrt((values[at] ** 2 + variance[at]).mean())
        else:
            least = _LEAST_REDUNDANCY * len(at)
            found = np.sqrt((values[at] ** 2).sum() / max(determined, least))
        changes[name] = float(np.clip(found, 1e-3 * declared, declared))
    return changes


def implausible(problem: SequenceProblem, state: State, options: ConstantsOptions) -> bool:
    """Whether a mounting or accelerometer bias is far beyond its declared prior.

    A board that hardly moves looks clean whatever its errors are. Weighted as clean, its static
    errors turn its constants, and the limb with them, out of all proportion.
    """
    values, cells = constant_values(state.constants), constant_cells(problem.layout)
    declared = declared_deviations(options)
    return any(
        declared[name] > 0 and bool((np.abs(values[cells[name]]) > _FAR * declared[name]).any())
        for name in ("accelerometer_bias", "mounting", "offset")
    )


def _rest(
    problem: SequenceProblem,
    state: State,
    draws: list[tuple[np.ndarray, np.ndarray]],
    built: Built,
    levels: Levels,
    often: float,
) -> float:
    """How far the subject was from the declared rest pose, per joint coordinate [rad]."""
    joints = joint_dofs(problem.layout.topology)
    rest = built.rest_frames
    middle = rest[len(rest) // 2]
    declared = jnp.asarray(built.terms.reference[0, middle])
    offset = np.asarray(
        difference(problem.layout.topology, declared, jnp.asarray(state.q[middle]))
    )[joints]
    images = [step[rest].mean(0)[joints] for step, _ in draws]
    leverage = often * np.mean([(x**2).sum() for x in images]) / levels.rest**2
    redundancy = max(len(offset) - leverage, _LEAST_REDUNDANCY * len(offset))
    return float(np.sqrt((offset**2).sum() / redundancy))

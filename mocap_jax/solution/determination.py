"""`determination`: which constants of a solve the recording tells, and which only the prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError
from mocap_jax.solution.solution import Solution

# A constant whose deviation is above this share of its prior's was hardly measured.
_UNDETERMINED = 0.9
# Two constants correlated beyond this are known in a combination only.
_CORRELATED = 0.95
_SHOWN = 6


@dataclass(frozen=True)
class Determination:
    """What a recording tells of the constants."""

    count: int
    """Constants solved for (scalars)."""
    rank: int
    """Independent combinations of them that the recording tells more about than the priors do."""
    undetermined: tuple[tuple[str, float], ...]
    """Constants whose deviation is the prior's to a tenth, and its share of the prior's."""
    correlated: tuple[tuple[str, str, float], ...]
    """Pairs whose correlation is beyond 0.95, the strongest first: only a combination is known."""

    def __str__(self) -> str:
        lines = [
            f"The recording tells more than the priors about {self.rank} of {self.count} "
            "combinations of constants."
        ]
        if self.undetermined:
            names = [name for name, _ in self.undetermined]
            lines.append(f"Not determined, the prior stands: {_listed(names)}.")
        if self.correlated:
            names = [f"{a} with {b} ({rho:+.3f})" for a, b, rho in self.correlated]
            lines.append(f"Known in combination only: {_listed(names)}.")
        return "\n".join(lines)


def determination(solution: Solution) -> Determination:
    """Rank, undetermined constants and correlations of a whole-sequence solve.

    With the prior's covariance P and the posterior's C of all constants (poses marginalised), the
    eigenvalues of P^-1/2 C P^-1/2 are the shares of the prior's variance that are left in
    independent combinations; below one half the data tell more than the prior.

    Args:
        solution: of `optimise`, with constants solved for.

    Raises:
        InputError: the solution has no covariance of constants (a filter, a solution file, a solve
            without constants).
    """
    names, covariance, prior = _posterior(solution)
    deviation = np.sqrt(np.diag(covariance))
    left = np.linalg.eigvalsh(covariance / np.outer(prior, prior))
    share = deviation / prior
    order = np.argsort(-share)
    undetermined = tuple((names[i], float(share[i])) for i in order if share[i] > _UNDETERMINED)
    correlation = covariance / np.outer(deviation, deviation)
    rows, columns = np.nonzero(np.triu(np.abs(correlation) > _CORRELATED, 1))
    pairs = sorted(
        (
            (names[i], names[j], float(correlation[i, j]))
            for i, j in zip(rows, columns, strict=True)
        ),
        key=lambda pair: -abs(pair[2]),
    )
    return Determination(len(names), int((left < 0.5).sum()), undetermined, tuple(pairs))


def _posterior(
    solution: Solution,
) -> tuple[list[str], Float[np.ndarray, "m m"], Float[np.ndarray, "m"]]:
    """Names, covariance and prior deviations of the constants that were free."""
    covariance, priors = solution.calibration_covariance, solution.calibration_prior_std
    if covariance is None:
        raise InputError(
            f"solution: no covariance of constants (method '{solution.method}'); valid: what "
            "`optimise` returns with constants solved for (files do not hold it)"
        )
    names = [
        f"{name}{axis}"
        for name, prior in priors.items()
        for axis in (("/x", "/y", "/z") if np.size(prior) == 3 else ("",))
    ]
    prior = np.concatenate([np.ravel(x) for x in priors.values()])
    free = np.flatnonzero(prior > 1e-6)
    return [names[i] for i in free], covariance[np.ix_(free, free)], prior[free]


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more

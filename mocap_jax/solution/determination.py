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
_OPENING = "The recording tells more than the priors about"


@dataclass(frozen=True)
class Determination:
    """What a recording tells of the constants."""

    count: int
    """Constants solved for (scalars; of biases that walk their mean and their steps)."""
    rank: int
    """Independent combinations of them that the recording tells more about than the priors do."""
    undetermined: tuple[tuple[str, float], ...]
    """Constants whose deviation is the prior's to a tenth, and its share of the prior's."""
    correlated: tuple[tuple[str, str, float], ...]
    """Pairs whose correlation is beyond 0.95, the strongest first: only a combination is known."""

    def __str__(self) -> str:
        return "\n".join(self.sentences)

    @property
    def sentences(self) -> tuple[str, ...]:
        """All of it in words; the first says the rank."""
        lines = [f"{_OPENING} {self.rank} of {self.count} combinations of constants."]
        if self.undetermined:
            names = _grouped([name for name, _ in self.undetermined])
            lines.append(f"Not determined, the prior stands: {_listed(names)}.")
        if self.correlated:
            names = [f"{a} with {b} ({rho:+.3f})" for a, b, rho in self.correlated]
            lines.append(f"Known in combination only: {_listed(names)}.")
        return tuple(lines)


def determination_remark(solution: Solution) -> str:
    """`determination` as one remark; empty for a solution that has no covariance of constants."""
    if solution.calibration_covariance is None or not len(solution.calibration_covariance):
        return ""
    found = determination(solution)
    return " ".join(found.sentences) if found.count else ""


def stated_determination(solution: Solution) -> str:
    """The remark on constants that a solution carries, from a file too; empty without one."""
    return next((text for text in solution.remarks if text.startswith(_OPENING)), "")


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
    names = [name + part for name, prior in priors.items() for part in _parts(np.shape(prior))]
    prior = np.concatenate([np.ravel(x) for x in priors.values()])
    free = np.flatnonzero(prior > 1e-6)
    return [names[i] for i in free], covariance[np.ix_(free, free)], prior[free]


def _parts(shape: tuple[int, ...]) -> list[str]:
    """Endings of the names of a constant's scalars; steps of a walk count from 1."""
    axes = ["/x", "/y", "/z"] if shape and shape[-1] == 3 else [""] * int(np.prod(shape))
    if len(shape) < 2:
        return axes
    return [f"/step {i + 1}{axis}" for i in range(shape[0]) for axis in axes]


def _grouped(names: list[str]) -> list[str]:
    """Names with all three axes of one constant as one, in the order of their first."""
    parents = [name[:-2] if name[-2:] in ("/x", "/y", "/z") else name for name in names]
    whole = {p for p in parents if parents.count(p) == 3}
    return list(dict.fromkeys(p if p in whole else n for p, n in zip(parents, names, strict=True)))


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more

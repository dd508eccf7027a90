"""Are innovations as large as the filter expects? Normalised innovations squared."""

from __future__ import annotations

from dataclasses import dataclass

from mocap_jax.errors import InputError
from mocap_jax.metrics.consistency import chi_square_band
from mocap_jax.solution import Solution


@dataclass(frozen=True)
class Nis:
    """Normalised innovations squared of one kind of measurement, over a recording."""

    value: float
    """Mean per degree of freedom; 1 when the filter's noise figures are honest."""
    count: int
    """Degrees of freedom: scalar measurements used, over all frames."""
    band: tuple[float, float]
    """Central interval in which an honest filter's value lies at the level asked for."""

    @property
    def honest(self) -> bool:
        """Whether the value lies in its band."""
        return self.band[0] <= self.value <= self.band[1]


def nis(solution: Solution, level: float = 0.95) -> dict[str, Nis]:
    """Normalised innovation squared (NIS) per degree of freedom, by kind of measurement.

    y' S^-1 y for the innovations y of one update (measured minus predicted) with their predicted
    covariance S, summed over the recording and divided by the number of scalar measurements used.
    It needs no truth. Innovations of an honest filter are independent from update to update, so
    the sum has a chi-square distribution and `Nis.band` follows from it. Above the band the filter
    trusts its motion model or sensors too much (values jump more than it expects), below it too
    little. Bands of long recordings are narrow: values a few per cent off are outside and do no
    harm. Doubtful ranges (`EkfOptions.range_gate`) count with the variance they were given.

    Args:
        solution: of `ekf`; the smoother's are those of its forward pass.
        level: of the bands.

    Returns:
        By kind: `accelerometer`, `gyroscope`, `orientation`, `range`, `root`; those measured.

    Raises:
        InputError: the solution is not of a filter, or a level outside 0 to 1.
    """
    if not solution.innovations:
        raise InputError(
            f"the solution (method {solution.method}) holds no innovations; valid: solutions of "
            "ekf and ekf_smoothed"
        )
    out = {}
    for kind, sums in solution.innovations.items():
        count = int(sums["count"])
        out[kind] = Nis(sums["squared"] / count, count, chi_square_band(count, level))
    return out

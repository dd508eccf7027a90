"""`Solution` and `Status`: what an estimator returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.recording.setup import Setup
from mocap_jax.trajectory.trajectory import Trajectory

if TYPE_CHECKING:
    import pandas
    import xarray


class Status(Enum):
    """How a solve ended; the value is a sentence for the user."""

    CONVERGED = "Converged: the cost no longer decreases."
    FILTERED = "The filter processed every frame."
    SMOOTHED = "The filter and the backward smoother processed every frame."
    MAX_ITERATIONS = "Stopped at the largest number of iterations of a round before convergence."
    STALLED = "Stopped: no step decreased the cost, although the gradient is not zero."
    DIVERGED = "Failed: the estimate became non-finite."
    SINGULAR = "Failed: the normal equations are singular, the data do not determine every pose."
    UNDETERMINED = "Converged, but the data do not determine every quantity; see `remarks`."

    @property
    def ok(self) -> bool:
        """Whether the estimate can be used."""
        return self not in (Status.DIVERGED, Status.SINGULAR)


@dataclass(frozen=True)
class Solution:
    """An estimated motion with its uncertainty and how it was found."""

    trajectory: Trajectory
    body: Body
    status: Status
    method: str
    """One of `methods.FILTERS`, "optimise" or "orientation"."""
    setup: Setup
    remarks: tuple[str, ...] = ()
    """Sentences for the user: what was salvaged, what the data cannot determine, ..."""
    covariance: Float[Array, "t nv nv"] | None = None
    """Marginal covariance of each pose, in the tangent space at it: of the delta with true pose
    `retract(q, delta)` [rad^2, m^2]."""
    pair_covariance: Float[Array, "t-1 nv nv"] | None = None
    """Covariance of pose k + 1 (rows) with pose k (columns), each in the tangent space at it."""
    observed: tuple[str, ...] = ()
    """Bodies (child segments) whose joint the used sensors observe."""
    cost: tuple[float, ...] = ()
    """Cost (half the sum of squared whitened residuals) at the start of each round and after each
    of its accepted steps."""
    iterations: int = 0
    """Steps tried, rejected ones included, over all rounds (the limit holds for each round)."""
    seconds_solve: float = 0.0
    seconds_compile: float = 0.0
    statistics: dict[str, dict[str, float]] = field(default_factory=dict)
    """Of the optimiser's residuals, or of the filter's innovations (for the smoother: those of its
    forward pass), by stream: `accelerometer/<sensor>`, `gyroscope/<sensor>`,
    `range/<source>-<receiver>`, ... Each holds `rms` (whitened), `rms_units` (SI), `bias` and
    `bias_units` (mean of measured minus predicted; of three axes the length of the mean vector),
    `count` of the values used, and `outliers` (share beyond 3 sigma). Those in units weight values
    by their precision, so that doubtful ranges count little. Ranges have `heard` (those with a
    confidence above 0), `rejected` (share of these not used: receiver behind the source) and
    `lowered` (share of those used whose weight the robust treatment lowers below half)."""
    innovations: dict[str, dict[str, float]] = field(default_factory=dict)
    """Of the filter, by kind of measurement (`accelerometer`, `range`, ...): `squared`, the sum of
    the normalised innovations squared, and `count`, its degrees of freedom (see `metrics.nis`)."""
    calibration: dict[str, np.ndarray] = field(default_factory=dict)
    """Estimated constants by name: `gyroscope_bias/<sensor>` [rad/s], `accelerometer_bias/...`
    [m/s^2], `mounting_rotation/...` (rotation vector, rad, sensor frame), `mounting_offset/...`
    [m], `segment_length/<segment>` (relative), ...; where they were asked for
    `accelerometer_scale/...` and `gyroscope_scale/...` (relative), `clock_offset/...` [s],
    `heading/...` [rad], `gyroscope_bias_walk/...` and `accelerometer_bias_walk/...`: (n, 3), the
    bias at n knots at equal distances from the first frame to the last (`.._bias/..` is its mean).
    """
    calibration_std: dict[str, np.ndarray] = field(default_factory=dict)
    """Their standard deviations, same keys."""
    calibration_prior_std: dict[str, np.ndarray] = field(default_factory=dict)
    """Standard deviations of the priors they were solved with, same keys (not in files); of a bias
    that walks those of its n - 1 steps, over the root of the time between knots."""
    calibration_covariance: Float[np.ndarray, "m m"] | None = None
    """Their joint covariance, in the order of `calibration_prior_std` laid end to end (not in
    files; see `determination`)."""
    options: dict[str, object] = field(default_factory=dict)
    """The options used, by name, for the record."""

    def to_xarray(self) -> xarray.Dataset:
        """Joint angles and segment poses over time, with names and units (time x joint)."""
        from mocap_jax.solution.tables import solution_to_xarray

        return solution_to_xarray(self)

    def to_dataframe(self) -> pandas.DataFrame:
        """Root pose and joint angles, one row a frame (see `solution_to_dataframe`)."""
        from mocap_jax.solution.tables import solution_to_dataframe

        return solution_to_dataframe(self)

"""Options of `range_only_path`."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.least_squares import SolverOptions
from mocap_jax.residuals.robust import LOSSES


@dataclass(frozen=True)
class RangeOnlyOptions:
    """Noise, and what is unknown besides the path. A deviation of 0 holds a constant at 0."""

    forward_noise: float = 0.02
    """Random walk of the travelled distance [m/s^0.5]."""
    sideways_noise: float = 0.02
    """Of slipping to the side [m/s^0.5]."""
    turn_noise: float = 0.005
    """Of the heading [rad/s^0.5]."""
    turn_bias_sigma: float = 0.02
    """Prior of the turn rate's constant error [rad/s]."""
    range_noise: float = 0.5
    """Of a range [m]."""
    bias_sigma: float = 5.0
    """Prior of each anchor's constant excess [m]."""
    scale_sigma: float = 0.1
    """Prior of the relative excess of all ranges [1]."""
    loss: str = "cauchy"
    """Robust loss of ranges; see `residuals.robust.LOSSES`."""
    loss_scale: float = 2.0
    """Range errors beyond so many deviations count as outliers."""
    start_sigma: tuple[float, float] = (1.0, 0.3)
    """Of the start: each coordinate [m], heading [rad]."""
    bias_starts: int = 41
    """Turn-rate errors tried for the path to start from, within three prior deviations."""
    solver: SolverOptions = field(
        default_factory=lambda: SolverOptions(max_iterations=100, tolerance=1e-3)
    )

    def __post_init__(self) -> None:
        if self.loss not in LOSSES:
            raise unknown_name("robust loss", self.loss, LOSSES)
        for name in ("forward_noise", "sideways_noise", "turn_noise", "range_noise", "loss_scale"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"{name} {getattr(self, name):g}: must be a number above 0")
        for name in ("turn_bias_sigma", "bias_sigma", "scale_sigma"):
            if not 0 <= getattr(self, name) < math.inf:
                raise InputError(
                    f"{name} {getattr(self, name):g}: must be a number above 0, or 0 to hold the "
                    "constant"
                )
        start = np.asarray(self.start_sigma)
        if start.shape != (2,) or not ((start > 0) & (start < math.inf)).all():
            raise InputError(
                f"start_sigma {self.start_sigma}: must be two numbers above 0: [m], [rad]"
            )
        if self.bias_starts < 1:
            raise InputError(f"bias_starts {self.bias_starts}: must be at least 1")

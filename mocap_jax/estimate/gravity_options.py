"""`GravityOptions`: when boards count as not accelerating, and how far their tilt is trusted."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.residuals.robust import LOSSES, LossName


@dataclass(frozen=True)
class GravityOptions:
    """When boards count as not accelerating, and how far their tilt is trusted then."""

    acceleration: float = 0.3
    """A board whose specific force differs more from g in size accelerates [m/s^2]. It covers bias
    and scale errors (consumer MEMS: 0.15 m/s^2) as well."""
    turn: float = 0.3
    """So may one that turns faster [rad/s]: points of a limb move in arcs."""
    duration: float = 0.25
    """For how long both must hold [s]: swinging limbs pass through g within hundredths."""
    sigma: float = 0.03
    """Deviation of the tilt told, per axis [rad]: what is slow acceleration (0.3 m/s^2), and no
    constant of the solve."""
    correlation_time: float = 0.5
    """How long such an error lasts [s]; frames within it count as one."""
    pull: float = 2.0
    """Filter only: tilts are corrected within so much time of standing still at least, however well
    the filter believes to know them: drifting biases of rates are no part of its belief [s]."""
    loss: LossName = "cauchy"
    """Robust loss: even acceleration sideways may leave the size at g. (The
    filter's is `cauchy`.)"""
    scale: float = 3.0
    """Its threshold, in standard deviations."""

    def __post_init__(self) -> None:
        for name in (
            "acceleration",
            "turn",
            "duration",
            "sigma",
            "correlation_time",
            "pull",
            "scale",
        ):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"gravity reference: {name} {getattr(self, name):g}: "
                                 "must be above 0, and finite")  # fmt: skip
        if self.loss not in LOSSES:
            raise unknown_name("robust loss of the gravity reference", self.loss, LOSSES)

"""`OrientationPassOptions`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.estimate.orientation_frame import ExtraResidual
from mocap_jax.pose_prior import PosePrior


@dataclass(frozen=True)
class OrientationPassOptions:
    """Options of `orientation_pass`."""

    weights: Mapping[str, float] = field(default_factory=dict)
    """Weight of the squared error of each sensor [1/rad^2]; sensors not named have 1, as in
    OpenSim; 0 leaves one out."""
    limits: bool = True
    """Keep hinges and slides within their ranges, as OpenSim keeps clamped coordinates."""
    warm_start: bool = False
    """True: every frame starts from the one before. False: every `seed_every`-th does, then all
    frames at once from the nearest of those; the same minimum, unless a motion is so fast that it
    leaves its neighbourhood within these frames."""
    seed_every: int = 10
    """Frames from one seed to the next."""
    root: str = "auto"
    """`given`: the root is where the recording says. `free`: it stays where the start has it, for
    orientations do not tell. `auto`: given if the recording has a root."""
    rate_hz: float | None = None
    """Frame grid; default the highest inertial rate."""
    pose_prior: PosePrior | None = None
    """What poses people take (`default_pose_prior()`): von Marcard 2017's Sparse Orientation Poser.
    """
    orientation_sigma: float = 0.05
    """How far a sensor of weight 1 is off, with its place on the segment [rad]: its weight against
    the pose prior."""
    share_sigma: float = 0.1
    """As `PriorOptions.share_sigma` [rad]."""
    residuals: tuple[ExtraResidual, ...] = ()
    """Further residuals `f(body, q) -> (m,)`, whitened in units of one radian of a sensor of weight
    1: a pose prior, a limit penalty, ... Traced by JAX; the tuple's functions are told apart by
    identity."""
    iterations: int = 60
    """Most steps a frame."""
    tolerance: float = 1e-6
    """A frame has converged when no coordinate moves by more [rad, m]."""

    def check(self, sensors: tuple[str, ...]) -> None:
        """Refuse wrong values.

        Raises:
            InputError: naming the option.
        """
        for name, weight in self.weights.items():
            if name not in sensors:
                raise unknown_name("weights: sensor", name, sensors)
            if not 0 <= weight < float("inf"):
                raise InputError(f"weights: '{name}' is {weight}; valid: zero or a positive number")
        if not self.orientation_sigma > 0 or not self.share_sigma > 0:
            raise InputError("orientation_sigma and share_sigma must be above 0")
        if self.root not in ("auto", "given", "free"):
            raise InputError(f"root is '{self.root}'; valid: auto, given, free")
        if self.seed_every < 1 or self.iterations < 1:
            raise InputError("seed_every and iterations must be 1 or more")

"""`PlacementOptions`: what is asked of a placement and how it is searched for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.estimate import ConstantsOptions, NoiseOptions, PriorOptions
from mocap_jax.recording import NoiseFigures

OBJECTIVES = ("A", "D", "E", "worst")
"""Mean squared error, volume of the uncertainty, worst direction, worst joint."""
SENSOR_KINDS = ("A", "G", "AG")
"""Accelerometer, gyroscope, both on one board."""


OVER = ("mean", "worst")
"""How errors of several motions make one."""
QUANTITIES = ("position", "orientation")
"""Of joint centres, relative to the root; of segments, relative to the root segment."""
ROOTS = ("given", "free")
"""Whether the root pose is measured."""


@dataclass(frozen=True)
class ErrorModel:
    """How a sensor of the studied kind errs, and what the estimator assumes beside it."""

    kinds: str = "AG"
    """What a board measures: A accelerometer, G gyroscope."""
    rate_hz: float = 140.0
    """Sampling rate that the white figures are stated for [Hz]."""
    noise: NoiseFigures = field(
        default_factory=lambda: NoiseFigures(root_position=0.002, root_orientation=0.005)
    )
    """White noise of boards and of a given root."""
    model: NoiseOptions = field(default_factory=NoiseOptions)
    """Model errors that grow with the motion: lever arm, lag (soft tissue, clocks), and what is
    left in quiet moments; the estimator's own figures."""
    constants: ConstantsOptions = field(default_factory=ConstantsOptions)
    """Priors of biases, mounting rotation and offset: the mounting errors to be robust against."""
    prior: PriorOptions = field(default_factory=PriorOptions)
    """The estimator's priors on poses and motion."""

    def __post_init__(self) -> None:
        if self.kinds not in SENSOR_KINDS:
            raise unknown_name("sensor kind", self.kinds, SENSOR_KINDS)
        if self.constants.corrections:
            raise InputError(
                f"constants: placement does not know {', '.join(self.constants.corrections)}; "
                "valid: 0 (off)"
            )


@dataclass(frozen=True)
class SearchOptions:
    """How hard to search."""

    restarts: int = 3
    """Starts of the continuous search; the first from the middle of every patch."""
    steps: int = 25
    """Gradient steps of each."""
    learning_rate: float = 0.25
    """Of Adam, in the patches' unbounded coordinates."""
    evaluations: int = 60
    """Sensor subsets evaluated exactly, at most, by the selection of segments."""
    gap: float = 0.02
    """Relative gap to the proven bound at which the selection stops."""
    ranked: int = 5
    """Placements in the ranking."""
    seed: int = 0
    """Of the random probes and starts."""

    def __post_init__(self) -> None:
        for name, least in (("restarts", 1), ("steps", 0), ("evaluations", 1), ("ranked", 1)):
            if getattr(self, name) < least:
                raise InputError(f"{name} {getattr(self, name)}: must be {least} or more")


@dataclass(frozen=True)
class Constraints:
    """What a placement must respect."""

    allowed: tuple[str, ...] = ()
    """Segments that may carry a sensor; empty means all with a reachable patch."""
    required: tuple[str, ...] = ()
    """Segments that must carry one."""
    symmetric: bool = False
    """Left and right alike."""
    costs: dict[str, float] = field(default_factory=dict)
    """Cost of a sensor by segment; 1 where not named."""
    budget: float | None = None
    """Largest total cost; None for no limit."""
    hub: str = "Pelvis"
    """Segment that wires run to."""
    wire_m: float | None = None
    """Longest total length of wire, one from each sensor along the body to the hub [m]."""
    distance_m: float = 0.05
    """Least distance between two sensors, in the reference pose [m]."""

    def __post_init__(self) -> None:
        for name, cost in self.costs.items():
            if not 0.0 <= cost < float("inf"):
                raise InputError(f"costs: {name} {cost:g}: must be a number of zero or more")


@dataclass(frozen=True)
class PlacementOptions:
    """Options of `place`."""

    sensors: int = 6
    """How many to place."""
    most: int | None = None
    """Number of sensors up to which the trade-off curve goes; default two more than `sensors`."""
    objective: Literal["A", "D", "E", "worst"] = "A"
    """A: mean squared error; D: log determinant; E: worst direction; worst: worst joint."""
    over: Literal["mean", "worst"] = "mean"
    """Over motions: the mean, or the worst of them."""
    root: Literal["given", "free"] = "given"
    """Whether the root pose is measured, as `simulate` does and `reconstruct` then uses."""
    quantity: Literal["position", "orientation"] = "position"
    """Errors of joint centres, relative to the root, or of segments' orientations, relative to the
    root segment. (D is of all unknowns together.)"""
    joints: tuple[str, ...] = ()
    """Segments whose joint centres, or orientations, count; empty means all (toes included)."""
    habits: Literal["motions", "estimator"] = "motions"
    """How far and how fast joints move when no sensor sees them: as the study's motions do, or as
    the estimator's weak priors say, which allow more than people do."""
    rate_hz: float = 20.0
    """Frame grid of the study [Hz]: information is a density in time and hardly depends on it."""
    motion_density: float = 60.0
    """Spectral density of joint acceleration assumed of people [rad^2/s^3]; the optimiser's figure
    for joints between boards, which with few boards are nearly all."""
    probes: int = 2
    """Random directions per joint and motion for the trace (common to all evaluations)."""
    errors: ErrorModel = field(default_factory=ErrorModel)
    constraints: Constraints = field(default_factory=Constraints)
    search: SearchOptions = field(default_factory=SearchOptions)

    def __post_init__(self) -> None:
        if self.objective not in OBJECTIVES:
            raise unknown_name("objective", self.objective, OBJECTIVES)
        if self.over not in OVER:
            raise unknown_name("over", self.over, OVER)
        if self.quantity not in QUANTITIES:
            raise unknown_name("quantity", self.quantity, QUANTITIES)
        if self.root not in ROOTS:
            raise unknown_name("root", self.root, ROOTS)
        if self.habits not in ("motions", "estimator"):
            raise unknown_name("habits", self.habits, ("motions", "estimator"))
        if self.sensors < 1:
            raise InputError(f"sensors {self.sensors}: must be 1 or more")
        if self.most is not None and self.most < self.sensors:
            raise InputError(f"most {self.most}: must be {self.sensors} (sensors) or more")
        if not self.rate_hz >= 10:
            raise InputError(f"rate_hz {self.rate_hz:g}: must be 10 or more")

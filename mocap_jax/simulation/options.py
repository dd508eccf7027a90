"""Options of a simulation that do not depend on how noisy the sensors are."""

from __future__ import annotations

from dataclasses import dataclass

from mocap_jax.errors import InputError


@dataclass(frozen=True)
class SimulationOptions:
    """How a known motion becomes a recording."""

    cutoff_hz: float = 12.0
    """Low-pass of the motion [Hz]; 20 is a stress test."""
    fastest_joint: float = 40.0
    """Joints that turn faster between two frames of the clip [rad/s] are taken for tracking errors
    and bridged. A pitcher's elbow reaches about 40 (Fleisig et al. 1999, J. Biomech. 32); raise it
    for throws, where the shoulder turns faster."""
    rest_s: float = 2.0
    """Still hold of the declared pose at the start [s] (Vlasic 2007, section 5.4)."""
    blend_s: float = 1.5
    """Shortest transition from the rest pose into the clip [s]; longer if joints travel far."""
    inertial_rate_hz: float = 140.0
    """Sampling rate of the boards [Hz] (Vlasic 2007, section 3.3)."""
    orientations: bool = False
    """Boards report their orientation as well, as commercial inertial sensors do."""
    magnetic_field: tuple[float, float, float] | None = None
    """Field in the world [T], for instance `earth_field(latitude)`: boards measure it; None: they
    have no magnetometers."""
    pulse_interval_s: float = 0.008
    """Time between pulses of successive sources [s] (Vlasic 2007, section 3.2)."""
    speed_of_sound: float = 343.0
    """Speed that turns times of flight into distances [m/s] (dry air at 20 degrees Celsius)."""
    max_range_m: float = 2.75
    """Longest distance that is heard before the next pulse [m] (Vlasic 2007, section 3.2)."""
    start_utc_ns: int = 0
    """Absolute start of the recording [UTC ns]."""

    def __post_init__(self) -> None:
        positive = ("cutoff_hz", "fastest_joint", "rest_s", "blend_s", "inertial_rate_hz",
                    "pulse_interval_s", "speed_of_sound", "max_range_m")  # fmt: skip
        for name in positive:
            if not getattr(self, name) > 0:
                raise InputError(f"{name} {getattr(self, name):g}: must be above 0")

"""`Setup`: what is declared about a recording before any estimation (attachment `setup.toml`)."""

from __future__ import annotations

from dataclasses import dataclass, field

from mocap_jax.recording.calibration import Calibration


@dataclass(frozen=True)
class NoiseFigures:
    """Declared standard deviations of the measurements (the paper's figures by default)."""

    accelerometer: float = 0.02
    """Per axis and sample [m/s^2] (Vlasic 2007, section 5.2)."""
    gyroscope: float = 0.002
    """Per axis and sample [rad/s] (Vlasic 2007, section 5.2)."""
    range: float = 0.0025
    """At full confidence [m] (Vlasic 2007, section 5.2)."""
    orientation: float = 0.02
    """Per axis, where sensors measure orientation [rad]."""
    magnetometer: float = 1e-6
    """Per axis [T]."""
    root_position: float = 0.005
    """Per axis, of the externally measured root [m]."""
    root_orientation: float = 0.01
    """Per axis, of the externally measured root [rad]."""


@dataclass(frozen=True)
class SensorSpec:
    """One sensor board."""

    name: str
    """Topic name: `/inertial/<name>`."""
    site: str
    """Site of the body model that carries it (normally the same as `name`)."""
    rate_hz: float
    """Nominal inertial sampling rate."""


@dataclass(frozen=True)
class RestHold:
    """A still interval in a declared pose, held at the start (Vlasic 2007, section 5.4)."""

    start: float
    """[s]"""
    end: float
    """[s]"""
    pose: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Declared coordinates by joint name (hinge/slide one number, ball wxyz, free xyz + wxyz)
    of the body; joints not named are at the model's reference pose."""


@dataclass(frozen=True)
class Setup:
    """Sensors, sources, noise and rest hold of a recording, as declared by its user."""

    sensors: tuple[SensorSpec, ...] = ()
    sources: tuple[str, ...] = ()
    """Site names of the ultrasonic sources, in firing order."""
    pulse_interval: float = 0.008
    """Time between pulses of successive sources [s]."""
    speed_of_sound: float = 343.0
    """Used to turn times of flight into distances [m/s]."""
    noise: NoiseFigures = field(default_factory=NoiseFigures)
    rest: RestHold | None = None
    score_from: float = 0.0
    """Errors are scored from this time on (after rest hold and blend) [s]."""
    calibration: Calibration = field(default_factory=Calibration)
    """What calibration recordings have shown of the sensors."""
    provenance: dict[str, str | float | int | bool] = field(default_factory=dict)
    """Free facts: motion file, profile, seed, low-pass cut-off, device, ..."""

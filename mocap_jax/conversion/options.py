"""`ConvertOptions`: what to know and do beyond what the files say."""

from __future__ import annotations

from dataclasses import dataclass

from mocap_jax.errors import InputError, unknown_name

ORIENTATIONS = ("vqf", "vqf-magnetometer")


@dataclass(frozen=True)
class ConvertOptions:
    """Options of `convert`. None keeps what the format, the file or the mapping says."""

    rate_hz: float | None = None
    """Sampling rate where the files do not say, or say wrongly [Hz]."""
    trial: str | None = None
    """Which trial, where a folder holds several."""
    accelerometer_unit: str | None = None
    """m/s^2, g or mg."""
    gyroscope_unit: str | None = None
    """rad/s, deg/s, mdeg/s or rev/s."""
    magnetometer_unit: str | None = None
    """T, mT, uT, nT, G, mG or a.u. (normalised)."""
    quaternion_order: str | None = None
    """wxyz or xyzw."""
    quaternion_direction: str | None = None
    """sensor-to-world or world-to-sensor."""
    gravity_sign: int | None = None
    """1: at rest the accelerometer reads +g along up; -1: along down."""
    acceleration: str | None = None
    """specific-force, or gravity removed: free-world or free-sensor."""
    world_up: str | None = None
    """Axis of the files' world that points up: z, y, x or -z."""
    orientation: str | None = None
    """Estimate orientations where sensors measure none: vqf, or vqf-magnetometer."""
    strict: bool = False
    """Findings of the checks are errors."""

    def __post_init__(self) -> None:
        if self.orientation is not None and self.orientation not in ORIENTATIONS:
            raise InputError(
                f"orientation: {unknown_name('estimator', self.orientation, ORIENTATIONS)}"
            )
        if self.rate_hz is not None and not 0 < self.rate_hz < float("inf"):
            raise InputError(f"rate_hz must be a number above zero, not {self.rate_hz}")

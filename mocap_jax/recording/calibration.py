"""`Calibration`: what calibration recordings have shown of the sensors (`setup.toml`)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from mocap_jax.body.site_names import PREFIXES

Triple = tuple[float, float, float]
_NONE: Triple = (0.0, 0.0, 0.0)


def triple(values: Iterable[float]) -> Triple:
    """Three numbers, one for each axis, as plain Python ones."""
    x, y, z = (float(v) for v in values)
    return x, y, z


def same_source(a: str, b: str) -> bool:
    """Whether two names mean one source: the prefix of its site may be left out of one."""
    return a == b or a == _bare(b) or _bare(a) == b


def _bare(site: str) -> str:
    return next((site.removeprefix(p) for p in PREFIXES if site.startswith(p)), site)


@dataclass(frozen=True)
class AxisCalibration:
    """A sensor of three axes: reading = zero + slope * true value, each axis by itself."""

    zero: Triple = _NONE
    """Reading at rest [m/s^2 or rad/s]."""
    slope: Triple = (1.0, 1.0, 1.0)
    """Reading per true value [1]."""
    zero_sigma: Triple = _NONE
    """Standard deviation of the zero; 0 where it is not known."""
    slope_sigma: Triple = _NONE
    """The same of the slope."""


@dataclass(frozen=True)
class SourceOffset:
    """Constant excess of an ultrasonic source's distances."""

    offset: float
    """Measured less true distance [m]."""
    sigma: float = 0.0
    """Its standard deviation [m]; 0 where it is not known."""


@dataclass(frozen=True)
class AxisNoise:
    """Noise of a sensor of three axes, from its Allan deviation; 0 where none was seen."""

    white: Triple
    """Root of the spectral density: deviation of means over 1 s [m/s^1.5 or rad/s^0.5]."""
    instability: Triple = _NONE
    """Bias instability B [m/s^2 or rad/s] (IEEE Std 952)."""
    random_walk: Triple = _NONE
    """Growth of the bias in 1 s [m/s^2.5 or rad/s^1.5]."""


@dataclass(frozen=True)
class Calibration:
    """Figures by sensor name or source site; what is not named is taken as it reads."""

    accelerometer: dict[str, AxisCalibration] = field(default_factory=dict)
    gyroscope: dict[str, AxisCalibration] = field(default_factory=dict)
    source_offset: dict[str, SourceOffset] = field(default_factory=dict)
    """Prefixes of sites (`source/`, `anchor/`) may be left out."""
    accelerometer_noise: dict[str, AxisNoise] = field(default_factory=dict)
    gyroscope_noise: dict[str, AxisNoise] = field(default_factory=dict)
    applied: bool = False
    """Whether the readings that stand with it are corrected already."""

    def updated(self, newer: Calibration) -> Calibration:
        """The same with the figures of a newer one; not applied."""
        kept = {
            name: offset
            for name, offset in self.source_offset.items()
            if not any(same_source(name, other) for other in newer.source_offset)
        }
        return Calibration(
            accelerometer=self.accelerometer | newer.accelerometer,
            gyroscope=self.gyroscope | newer.gyroscope,
            source_offset=kept | newer.source_offset,
            accelerometer_noise=self.accelerometer_noise | newer.accelerometer_noise,
            gyroscope_noise=self.gyroscope_noise | newer.gyroscope_noise,
        )

    def offset_of(self, site: str) -> float:
        """Measured less true distances of a source [m]; 0 where it is not calibrated."""
        named = (site, *(name for name in self.source_offset if same_source(name, site)))
        found = next((self.source_offset[n] for n in named if n in self.source_offset), None)
        return 0.0 if found is None else found.offset

    @property
    def corrects(self) -> bool:
        """Whether there is anything to apply to readings."""
        return bool(self.accelerometer or self.gyroscope or self.source_offset)

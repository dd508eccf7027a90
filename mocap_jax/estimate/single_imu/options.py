"""`SingleImuOptions`: every choice of `smooth_orientation`, with its default's reason."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

from mocap_jax.errors import InputError
from mocap_jax.least_squares import SolverOptions


@dataclass(frozen=True)
class SingleImuOptions:
    """What is assumed of sensor and motion. Deviations of 0 are refused: use a small one."""

    interval: float = 0.5
    """Distance of knots [s]: orientation, velocity and position are unknowns there, in between
    samples are integrated. About the time in which a hand changes its place."""
    reach: float = 0.3
    """Standard deviation of the position about one fixed place, each axis [m]: arm's reach."""
    speed: float = 1.0
    """Standard deviation of the velocity, each axis [m/s]: a moving hand."""
    gyroscope_noise: float = 2e-4
    """White noise of rates [rad/s/sqrt(Hz)]: twice what consumer MEMS show at rest (0.005
    deg/s/sqrt(Hz), InvenSense MPU-6050 specification), for errors that only motion brings."""
    accelerometer_noise: float = 0.01
    """The same of specific forces [m/s^2/sqrt(Hz)]: 400 ug/sqrt(Hz), twice and a half."""
    gyroscope_bias_sigma: float = 0.05
    """Prior standard deviation of the bias at the start [rad/s] (3 deg/s, not calibrated)."""
    gyroscope_walk_sigma: float = 2e-5
    """Random walk of the bias [rad/s/sqrt(s)]: 40 deg/h in 100 s, the in-run instability of
    consumer MEMS."""
    gyroscope_scale_sigma: float = 0.01
    """Prior standard deviation of each entry of the gyroscope's relative errors: scale, and angles
    of its axes against the accelerometer's (factory calibration leaves about 1 %; the
    specification's 2 % cross-axis sensitivity is a bound)."""
    accelerometer_bias_sigma: float = 0.1
    """Prior standard deviation [m/s^2] (10 mg)."""
    accelerometer_scale_sigma: float = 0.01
    """Prior standard deviation of the scale of each axis, relative."""
    still_rate: float = 0.01
    """An interval may be still where the rates' standard deviation is below this [rad/s] ..."""
    still_force: float = 0.2
    """... and that of the specific forces below this [m/s^2] ..."""
    still_bias: float = 0.1
    """... and no mean rate is above this [rad/s] (more is a turn, not a bias)."""
    still_intervals: int = 3
    """This many neighbours must be so."""
    still_turn: float = 1e-4
    """How far a still sensor turns in a second, growing as a random walk [rad/sqrt(s)]."""
    still_speed: float = 2e-3
    """How fast it moves [m/s]."""
    robust_scale: float = 3.0
    """Huber threshold of an interval's rotation and translation, in standard deviations of each
    component (taps, vibration, clipped samples)."""
    gravity: float = 9.81
    """[m/s^2]"""
    solver: SolverOptions = field(
        default_factory=lambda: SolverOptions(max_iterations=20, initial_damping=0.0)
    )
    """Gauss-Newton."""

    def __post_init__(self) -> None:
        for entry in dataclasses.fields(self):
            value = getattr(self, entry.name)
            if entry.name != "solver" and not value > 0:
                raise InputError(f"{entry.name}={value}: must be positive")

"""`JointOptions`: choices of `find_joint`."""

from __future__ import annotations

from dataclasses import dataclass

from mocap_jax.errors import InputError


@dataclass(frozen=True)
class JointOptions:
    """How a joint is found from the motion of two sensors."""

    window: float = 5.0
    """Rates are integrated over windows this long [s]; between them the relative orientation starts
    anew. Longer ones hold more accelerations that tell it, but drift more (0.01 rad/s make three
    degrees in 5 s)."""
    arm_sigma: float = 0.3
    """Prior standard deviation of each component of a lever arm [m]: all that is known of a
    direction that the motion does not tell."""
    gyroscope_bias_sigma: float = 0.01
    """Prior standard deviation of the gyroscopes' biases [rad/s] (see `ConstantsOptions`)."""
    accelerometer_bias_sigma: float = 0.15
    """The same of the accelerometers [m/s^2]."""
    clock_sigma: float = 0.005
    """Prior standard deviation of the difference of the sensors' clocks [s] (radio-connected
    boards: 0.002 to 0.01). The second's readings are moved by it along their slopes."""
    scale_sigma: float = 0.01
    """Error of the scales of accelerometers and gyroscopes, relative, in the stated deviations of
    lever arms: accelerations in the joint are as (rate squared) times arm (MPU-6050: up to 0.03
    before calibration, a third of it after)."""
    off_axis: float = 0.1
    """A joint has an axis or two when at most this share of the relative rate (root mean square) is
    off them: play, bent axes and noise."""
    determined: float = 0.01
    """A direction of the lever arms counts as determined when its deviation is below this [m]."""

    def __post_init__(self) -> None:
        for name in ("window", "arm_sigma", "gyroscope_bias_sigma", "accelerometer_bias_sigma",
                     "clock_sigma", "off_axis", "determined"):  # fmt: skip
            if not getattr(self, name) > 0:
                raise InputError(f"JointOptions.{name} {getattr(self, name):g}: must be above 0")
        if not self.scale_sigma >= 0:
            raise InputError(f"JointOptions.scale_sigma {self.scale_sigma:g}: must not be negative")

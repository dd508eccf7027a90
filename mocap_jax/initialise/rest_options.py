"""`RestOptions`: what to estimate from a rest hold."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RestOptions:
    """Options of `rest_pose`. A quantity that is switched off keeps its nominal value."""

    pose: bool = True
    """Improve the pose."""
    mounting: bool = True
    """Tune the sensors' mounting rotations."""
    gyroscope_bias: bool = True
    """Take the mean rate at rest as the gyroscope's offset."""
    accelerometer_bias: bool = True
    """Estimate accelerometer offsets (at rest only their part along gravity shows)."""
    pose_sigma: float = 0.05
    """How well the subject takes the declared pose, per degree of freedom [rad] (3 degrees)."""
    undeclared_pose_sigma: float = 0.35
    """The same when no pose was declared and the model's reference pose stands in [rad]."""
    mounting_sigma: float = 0.05
    """How well sensors are mounted, per axis [rad] (3 degrees)."""
    accelerometer_bias_sigma: float = 0.05
    """Size of accelerometer offsets, per axis [m/s^2]."""
    gyroscope_bias_sigma: float = 0.05
    """Size of gyroscope offsets, per axis [rad/s]; used where there is no rest to measure them."""
    root_position_sigma: float = 0.02
    """Of the position of every root at rest that is not measured [m]."""
    stillness_sigma: float = 0.02
    """Error of a mean accelerometer reading from the subject's own small movements [m/s^2]."""
    adapt: bool = True
    """Scale pose and mounting sigmas down to what the readings show: with a declared pose and
    mounting that agree with them nothing is changed for nought."""
    search: float = 1.0
    """Without a declared hold, look for a still window in this much of the start [s]."""
    window: float = 0.5
    """Length of that window [s]."""
    still_rate: float = 0.15
    """RMS angular rate above which a window does not count as still [rad/s]."""

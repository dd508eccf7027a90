"""Orientation of a single inertial sensor by one smoothing of the whole recording."""

from mocap_jax.estimate.single_imu.options import SingleImuOptions
from mocap_jax.estimate.single_imu.smooth import SingleImuSolution, smooth_orientation

__all__ = ["SingleImuOptions", "SingleImuSolution", "smooth_orientation"]

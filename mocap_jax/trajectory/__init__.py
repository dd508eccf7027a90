"""Poses over time."""

from mocap_jax.trajectory.trajectory import Trajectory

__all__ = ["Trajectory"]

"""Measurements on the frame grid, and what the body predicts for them."""

from mocap_jax.measurement.frame_data import FrameData, gather

__all__ = ["FrameData", "gather"]

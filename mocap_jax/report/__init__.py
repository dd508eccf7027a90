"""Pages and pictures for people."""

from mocap_jax.report.animation import write_animation
from mocap_jax.report.page import write_report
from mocap_jax.report.stick import motion_strip, plot_body

__all__ = ["motion_strip", "plot_body", "write_animation", "write_report"]

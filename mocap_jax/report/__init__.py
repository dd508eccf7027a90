"""Pages and pictures for people."""

from mocap_jax.report.allan_picture import allan_figure, write_allan_picture
from mocap_jax.report.animation import write_animation
from mocap_jax.report.page import write_report
from mocap_jax.report.placement_picture import placement_figure, write_placement_picture
from mocap_jax.report.stick import plot_body
from mocap_jax.report.strip import motion_strip

__all__ = [
    "allan_figure", "motion_strip", "placement_figure", "plot_body", "write_allan_picture",
    "write_animation", "write_placement_picture", "write_report",
]  # fmt: skip

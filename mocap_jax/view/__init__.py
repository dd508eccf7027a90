"""Solutions in the Rerun viewer, or as its files."""

from mocap_jax.view.rerun_view import save_view, show_view

__all__ = ["save_view", "show_view"]

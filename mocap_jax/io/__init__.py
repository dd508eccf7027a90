"""Files: recordings and solutions in MCAP, set-ups in TOML, exports for other programs."""

from mocap_jax.io.describe import describe
from mocap_jax.io.export import export_motion
from mocap_jax.io.recording_reader import read_recording
from mocap_jax.io.recording_writer import write_recording
from mocap_jax.io.setup_figures import SetupFigures, read_setup_figures, update_setup_file
from mocap_jax.io.setup_toml import read_setup, setup_from_toml, setup_to_toml, write_setup
from mocap_jax.io.solution_file import read_solution, write_solution
from mocap_jax.io.validate import validate_recording

__all__ = [
    "SetupFigures", "describe", "export_motion", "read_recording", "read_setup",
    "read_setup_figures", "read_solution", "setup_from_toml", "setup_to_toml", "update_setup_file",
    "validate_recording", "write_recording", "write_setup", "write_solution",
]  # fmt: skip

"""Files: recordings and solutions in MCAP, set-ups in TOML, exports for other programs."""

from mocap_jax.io.mcap_recording import read_recording, write_recording
from mocap_jax.io.setup_toml import read_setup, setup_from_toml, setup_to_toml, write_setup

__all__ = [
    "read_recording", "read_setup", "setup_from_toml", "setup_to_toml", "write_recording",
    "write_setup",
]  # fmt: skip

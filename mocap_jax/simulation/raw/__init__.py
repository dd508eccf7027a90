"""Known motion to what the driver box samples: one wire a board, sound and telemetry on it."""

from mocap_jax.simulation.raw.options import RawOptions
from mocap_jax.simulation.raw.simulate_raw import RawSimulation, simulate_raw

__all__ = ["RawOptions", "RawSimulation", "simulate_raw"]

"""Known motion to a recording with its truth, by C MuJoCo's physics."""

from mocap_jax.simulation.default_suit import default_suit
from mocap_jax.simulation.magnetic import earth_field
from mocap_jax.simulation.mounting import mount
from mocap_jax.simulation.named_suits import SUITS, VALIDATION, named_suit
from mocap_jax.simulation.options import SimulationOptions
from mocap_jax.simulation.profiles import PROFILES, Profile
from mocap_jax.simulation.same_rate import frame_rate, same_rate
from mocap_jax.simulation.simulate import simulate
from mocap_jax.simulation.suit import Anchor, Mounting, Suit
from mocap_jax.simulation.suit_file import load_suit, save_suit
from mocap_jax.simulation.suits_together import suits_together

__all__ = [
    "PROFILES", "SUITS", "VALIDATION", "Anchor", "Mounting", "Profile", "SimulationOptions", "Suit",
    "default_suit", "earth_field", "frame_rate", "load_suit", "mount", "named_suit", "same_rate",
    "save_suit", "simulate", "suits_together",
]  # fmt: skip

"""Raw recordings of a driver box to calibrated measurements."""

from mocap_jax.decoding.air import AirOptions
from mocap_jax.decoding.decode_raw import Decoded, Gap, decode_raw
from mocap_jax.decoding.inertial import with_round_off

__all__ = ["AirOptions", "Decoded", "Gap", "decode_raw", "with_round_off"]

"""Raw recordings of a driver box to calibrated measurements."""

from mocap_jax.decoding.decode_raw import Decoded, decode_raw

__all__ = ["Decoded", "decode_raw"]

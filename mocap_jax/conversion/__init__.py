"""Recordings of other systems to ours: read, checked, mounted on a body."""

from mocap_jax.conversion.convert import Converted, convert, converted
from mocap_jax.conversion.options import ConvertOptions
from mocap_jax.conversion.wear import wear

__all__ = ["ConvertOptions", "Converted", "convert", "converted", "wear"]

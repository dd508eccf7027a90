"""Known motions: clips from files, built-in routines, and bodies that perform them."""

from mocap_jax.motion.motion import Motion

__all__ = ["Motion"]

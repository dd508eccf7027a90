"""The command line `mocap-jax`: one file a verb."""

from mocap_jax.cli.main import main

__all__ = ["main"]

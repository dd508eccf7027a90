"""`mocap-jax calibrate accelerometer`: zeros and slopes of accelerometers from six still positions."""

from __future__ import annotations

import argparse

from mocap_jax.cli.calibrate_kind import Kinds, add_kind, add_output, add_recordings


def add_parser(kinds: Kinds) -> None:
    """The parser of this kind."""
    parser = add_kind(
        kinds, "accelerometer", summary="zeros and slopes of accelerometers from six still positions",
        example="mocap-jax calibrate accelerometer REC.mcap -o setup.toml", note="", run=run,
    )  # fmt: skip
    add_recordings(parser)
    add_output(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the kind."""
    raise NotImplementedError

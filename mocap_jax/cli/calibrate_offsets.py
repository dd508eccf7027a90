"""`mocap-jax calibrate offsets`: find the offsets of ultrasonic sources from known distances."""

from __future__ import annotations

import argparse

from mocap_jax.cli.calibrate_kind import Kinds, add_kind, add_output, add_recordings


def add_parser(kinds: Kinds) -> None:
    """The parser of this kind."""
    parser = add_kind(
        kinds, "offsets", summary="find the offsets of ultrasonic sources from known distances",
        example="mocap-jax calibrate offsets REC.mcap -o setup.toml", note="", run=run,
    )  # fmt: skip
    add_recordings(parser)
    add_output(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the kind."""
    raise NotImplementedError

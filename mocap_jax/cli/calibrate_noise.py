"""`mocap-jax calibrate noise`: find the noise of inertial sensors from a still recording."""

from __future__ import annotations

import argparse

from mocap_jax.cli.calibrate_kind import Kinds, add_kind, add_output, add_recordings


def add_parser(kinds: Kinds) -> None:
    """The parser of this kind."""
    parser = add_kind(
        kinds, "noise", summary="find the noise of inertial sensors from a still recording",
        example="mocap-jax calibrate noise REC.mcap -o setup.toml", note="", run=run,
    )  # fmt: skip
    add_recordings(parser)
    add_output(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the kind."""
    raise NotImplementedError

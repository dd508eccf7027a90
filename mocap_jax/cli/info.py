"""`mocap-jax info`: what is in a file."""

from __future__ import annotations

import argparse

SUMMARY = "tell what is in a recording or a solution"
EXAMPLE = "mocap-jax info walk.mcap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument("file", metavar="FILE", help="recording or solution (.mcap)")


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    from mocap_jax.io import describe

    print(describe(arguments.file))
    return 0

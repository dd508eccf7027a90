"""`mocap-jax info`: what is in a file."""

from __future__ import annotations

import argparse

from mocap_jax.cli.exit_codes import SALVAGED, SUCCESS

SUMMARY = "tell what is in a file: recording, solution, motion, body or set-up"
EXAMPLE = "mocap-jax info walk.mcap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument("file", metavar="FILE", help=".mcap, .amc, .bvh, .npz, .xml, .asf or .toml")


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    from mocap_jax.io import describe

    text = describe(arguments.file)
    print(text)
    damaged = any("salvaged:" in line.lower() for line in text.splitlines())
    return SALVAGED if damaged else SUCCESS

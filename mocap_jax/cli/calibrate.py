"""`mocap-jax calibrate`: one kind of calibration a module."""

from __future__ import annotations

import argparse
from types import ModuleType

from mocap_jax.cli import calibrate_mounting

SUMMARY = "calibrate sensors and how they are worn"
EXAMPLE = "mocap-jax calibrate mounting walk.mcap --body human -o worn.mcap"
NOTE = "`mocap-jax calibrate KIND --help` says how to record for it."

KINDS: tuple[ModuleType, ...] = (calibrate_mounting,)
"""Each module gives `add_parser(kinds)`, which adds its parser and sets `calibrate` on it to a
function that takes the arguments and returns the exit code."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    kinds = parser.add_subparsers(dest="kind", metavar="KIND", required=True)
    for module in KINDS:
        module.add_parser(kinds)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen kind."""
    return arguments.calibrate(arguments)

"""`mocap-jax calibrate`: sensors and how they are worn, one kind of calibration a module."""

from __future__ import annotations

import argparse
from types import ModuleType

from mocap_jax.cli import (
    calibrate_accelerometer,
    calibrate_gyroscope,
    calibrate_mounting,
    calibrate_noise,
    calibrate_offsets,
)

SUMMARY = "calibrate sensors, and how they are worn"
EXAMPLE = "mocap-jax calibrate accelerometer six_positions.mcap -o setup.toml"
NOTE = (
    "`mocap-jax calibrate KIND --help` says how to record for it. Figures of sensors go to the\n"
    "tables [calibration] and [noise] of the set-up file (-o), whose other entries stay; --setup\n"
    "of simulate, decode and reconstruct uses them. `mounting` writes a recording that is worn."
)

KINDS: tuple[ModuleType, ...] = (
    calibrate_offsets,
    calibrate_accelerometer,
    calibrate_gyroscope,
    calibrate_noise,
    calibrate_mounting,
)
"""Each module gives `add_parser(kinds)`, which adds its parser and sets `calibrate` on it to a
function that takes the arguments and returns the exit code (see `calibrate_kind.add_kind`)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    kinds = parser.add_subparsers(dest="kind", metavar="KIND", required=True)
    for module in KINDS:
        module.add_parser(kinds)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen kind."""
    return arguments.calibrate(arguments)

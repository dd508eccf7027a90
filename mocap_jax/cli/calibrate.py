"""`mocap-jax calibrate`: figures of the sensors from calibration recordings, one kind a module."""

from __future__ import annotations

import argparse
from types import ModuleType

from mocap_jax.cli import (
    calibrate_accelerometer,
    calibrate_gyroscope,
    calibrate_noise,
    calibrate_offsets,
)

SUMMARY = "calibrate sensors from recordings made for it"
EXAMPLE = "mocap-jax calibrate accelerometer six_positions.mcap -o setup.toml"
NOTE = (
    "`mocap-jax calibrate KIND --help` says how to record for it. Figures go to the tables\n"
    "[calibration] and [noise] of the set-up file (-o), whose other entries stay; --setup of\n"
    "simulate, decode and reconstruct uses them."
)

KINDS: tuple[ModuleType, ...] = (
    calibrate_offsets,
    calibrate_accelerometer,
    calibrate_gyroscope,
    calibrate_noise,
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

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
    if "\nkind: recording\n" in text:
        print(_sensor_check(arguments.file))
    damaged = any("salvaged:" in line.lower() for line in text.splitlines())
    return SALVAGED if damaged else SUCCESS


def _sensor_check(path: str) -> str:
    """Sensors that look swapped, turned or of wrong unit, in words."""
    from mocap_jax.errors import InputError
    from mocap_jax.initialise import check_sensors
    from mocap_jax.io import read_recording

    try:
        check = check_sensors(read_recording(path))
    except InputError as error:
        return f"sensor check: not possible ({error})"
    lines = check.sentences or (() if check.remarks else ("nothing suspicious",))
    return "\n".join(f"sensor check: {line}" for line in (*lines, *check.remarks))

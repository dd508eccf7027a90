"""`mocap-jax info`: what is in a file."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import SALVAGED, SUCCESS

if TYPE_CHECKING:
    from mocap_jax.recording import Recording

SUMMARY = "tell what is in a file: recording, solution, motion, body or set-up"
EXAMPLE = "mocap-jax info walk.mcap"
NOTE = """exit codes:
  0  the file is sound; sensors that look swapped or turned (`sensor check`) are told, but do not
     change this: they are a judgement of how sensors were worn, and `reconstruct` accepts them
  1  it cannot be read at all
  2  wrong usage
  3  it is damaged: only a part could be read (`salvaged`), or what it holds cannot be true and
     `reconstruct` would refuse it (`fault`: wrong units, time that runs backwards, ...)"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument(
        "file",
        metavar="FILE",
        help=".mcap, .amc, .bvh, .npz, .xml, .osim, .asf, .json, .csv or .toml",
    )


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    from mocap_jax.io import describe, read_recording

    text = describe(arguments.file)
    print(text)
    damaged = any("salvaged:" in line.lower() for line in text.splitlines())
    if "\nkind: recording\n" in text:
        recording = read_recording(arguments.file)
        fault = _fault(recording, arguments.file)
        if fault is not None:
            print(f"fault: {fault}")
            damaged = True
        print(_sensor_check(recording))
    return SALVAGED if damaged else SUCCESS


def _fault(recording: Recording, path: str) -> str | None:
    """Why no estimator would accept the recording; None where they would, or given a body."""
    from mocap_jax.errors import InputError
    from mocap_jax.io import validate_recording

    if recording.body_xml is None:  # one can be given to `reconstruct`
        return None
    try:
        validate_recording(recording, name=path)
    except InputError as error:
        return str(error)
    return None


def _sensor_check(recording: Recording) -> str:
    """Sensors that look swapped, turned or of wrong unit, in words."""
    from mocap_jax.errors import InputError
    from mocap_jax.initialise import check_readings, check_sensors

    try:
        bodiless = recording.body_xml is None
        check = check_readings(recording) if bodiless else check_sensors(recording)
    except InputError as error:
        return f"sensor check: not possible ({error})"
    lines = check.sentences or (() if check.remarks else ("nothing suspicious",))
    return "\n".join(f"sensor check: {line}" for line in (*lines, *check.remarks))

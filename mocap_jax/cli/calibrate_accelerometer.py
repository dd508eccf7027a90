"""`mocap-jax calibrate accelerometer`: zeros and slopes from six still positions."""

from __future__ import annotations

import argparse

from mocap_jax.cli.calibrate_inertial import finish
from mocap_jax.cli.calibrate_kind import (
    Kinds,
    about,
    add_kind,
    add_outputs,
    add_recordings,
    check_outputs,
    read_recordings,
)
from mocap_jax.cli.parser import positive_float

NOTE = """How to record: lay the boards so that each axis points up and down once, six positions in
any order, each still for two seconds or longer, in one recording or several. Positions are found;
they need not be exact, and more than six are better."""


def add_parser(kinds: Kinds) -> None:
    """The parser of this kind."""
    parser = add_kind(
        kinds, "accelerometer",
        summary="zeros and slopes of accelerometers from six still positions",
        example="mocap-jax calibrate accelerometer six_positions.mcap -o setup.toml", note=NOTE,
        run=run,
    )  # fmt: skip
    add_recordings(parser)
    parser.add_argument(
        "--gravity", type=positive_float, default=9.81, metavar="G",
        help="where the recording was made [m/s^2] (9.81)",
    )  # fmt: skip
    add_outputs(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the kind."""
    check_outputs(arguments)
    from mocap_jax.calibration import AccelerometerOptions, calibrate_accelerometer

    recordings = read_recordings(arguments.recordings)
    with about(arguments.recordings):
        found = calibrate_accelerometer(recordings, AccelerometerOptions(arguments.gravity))
    return finish(arguments, found, recordings)

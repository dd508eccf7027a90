"""`mocap-jax calibrate gyroscope`: zeros and slopes from a turntable."""

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
from mocap_jax.cli.parser import number_between, positive_float

NOTE = """How to record: fix the boards to a turntable of known speed with each axis up and then
down (or let it turn both ways), at speed for two seconds or longer, in one recording or several.
Turns are found; the boards need not lie exactly level."""


def add_parser(kinds: Kinds) -> None:
    """The parser of this kind."""
    parser = add_kind(
        kinds, "gyroscope", summary="zeros and slopes of gyroscopes from a turntable",
        example="mocap-jax calibrate gyroscope turns.mcap --rpm 45 -o setup.toml", note=NOTE,
        run=run,
    )  # fmt: skip
    add_recordings(parser)
    parser.add_argument(
        "--rpm", type=positive_float, default=45.0, metavar="N",
        help="speed of the turntable [1/min] (45)",
    )  # fmt: skip
    parser.add_argument(
        "--accuracy", type=number_between(0, 0.5), default=0.001, metavar="SHARE",
        help="standard deviation of that speed, as a share of it (0.001)",
    )  # fmt: skip
    add_outputs(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the kind."""
    check_outputs(arguments)
    from mocap_jax.calibration import GyroscopeOptions, calibrate_gyroscope

    recordings = read_recordings(arguments.recordings)
    options = GyroscopeOptions(arguments.rpm, arguments.accuracy)
    with about(arguments.recordings):
        found = calibrate_gyroscope(recordings, options)
    return finish(arguments, found, recordings)

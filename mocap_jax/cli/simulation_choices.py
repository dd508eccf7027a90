"""Arguments of `simulate` that are `SimulationOptions`: rates, durations, what boards measure."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.cli.parser import number_between, positive_float

if TYPE_CHECKING:
    from mocap_jax.simulation import SimulationOptions

_FIELDS = {
    "cutoff": "cutoff_hz",
    "rate": "inertial_rate_hz",
    "rest": "rest_s",
    "blend": "blend_s",
    "fastest_joint": "fastest_joint",
    "pulse_interval": "pulse_interval_s",
    "max_range": "max_range_m",
}
"""Argument -> the option it sets, if it is given."""
_NOT_RAW = {
    "orientations": "carries none",
    "magnetometers": "carries no magnetic field",
    "rate": "has the boards' own rate",
}


def add_recording_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments about the recording, whoever moves and whatever goes wrong."""
    parser.add_argument(
        "--rate", type=number_between(10, 5000), metavar="HZ", help="of the boards (default 140)"
    )
    parser.add_argument(
        "--orientations", action="store_true", help="boards report their orientation as well"
    )
    parser.add_argument(
        "--magnetometers", type=number_between(-90, 90), metavar="LATITUDE",
        help="boards measure the earth's field at this magnetic latitude [deg] as well",
    )  # fmt: skip
    parser.add_argument(
        "--rest", type=number_between(0.5, 600), metavar="S",
        help="still hold at the start (default 2)",
    )  # fmt: skip
    parser.add_argument(
        "--blend", type=number_between(0.1, 60), metavar="S",
        help="shortest transition from there into the motion (default 1.5)",
    )  # fmt: skip
    parser.add_argument(
        "--cutoff", type=number_between(0.1, 1e3), metavar="HZ",
        help="low-pass of the motion (default 12)",
    )  # fmt: skip
    parser.add_argument(
        "--fastest-joint", type=positive_float, metavar="RAD/S",
        help="joints that turn faster between two frames are tracking errors, to be bridged "
        "(default 40; raise it for throws)",
    )  # fmt: skip
    parser.add_argument(
        "--pulse-interval", type=number_between(1e-3, 1), metavar="S",
        help="between pulses of successive ultrasonic sources (default 0.008)",
    )  # fmt: skip
    parser.add_argument(
        "--max-range", type=number_between(0.1, 20), metavar="M",
        help="longest distance that is heard (default: what a slot hears, 2.75 in 0.008 s); with "
        "--raw slots decide that, and this only how early the last pulse sounds",
    )  # fmt: skip


def simulation_options(arguments: argparse.Namespace) -> SimulationOptions:
    """The options that were asked for."""
    import numpy as np

    from mocap_jax.signals.ultrasonic.bands import heard_in_slot
    from mocap_jax.simulation import SimulationOptions, earth_field

    given = {
        field: getattr(arguments, name)
        for name, field in _FIELDS.items()
        if getattr(arguments, name) is not None
    }
    if arguments.pulse_interval is not None and arguments.max_range is None:
        given["max_range_m"] = heard_in_slot(arguments.pulse_interval)
    if arguments.magnetometers is not None:
        given["magnetic_field"] = earth_field(np.deg2rad(arguments.magnetometers))
    return SimulationOptions(orientations=arguments.orientations, **given)


def refuse_for_raw(arguments: argparse.Namespace) -> None:
    """Refuse what the driver box does not send; raises `UsageError`."""
    for name, why in _NOT_RAW.items():
        if getattr(arguments, name) not in (None, False):
            raise UsageError(f"--{name}: the driver box's telemetry {why}; leave out --raw")

"""Arguments of `simulate --raw`: levels on the wires, and the room."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import UsageError, unknown_choice, value_of

if TYPE_CHECKING:
    from mocap_jax.simulation.raw import RawOptions

_OPTION = "--raw-set"


def add_raw_arguments(parser: argparse.ArgumentParser) -> None:
    """`--raw` and `--raw-set`."""
    parser.add_argument(
        "--raw", action="store_true",
        help="write what the driver box samples (0.3 MB a second and wire); see mocap-jax decode",
    )  # fmt: skip
    parser.add_argument(
        _OPTION, dest="raw_set", action="append", default=[], metavar="NAME=VALUE",
        help="with --raw: a level on the wires or a figure of the room, e.g. floor_m=0 or "
        "interference=600 (may be repeated; a wrong name is answered by all)",
    )  # fmt: skip


def raw_options(arguments: argparse.Namespace) -> RawOptions:
    """What was asked for.

    Raises:
        UsageError: without `--raw`, of an unknown name, or no number of its range.
    """
    if arguments.raw_set and not arguments.raw:
        raise UsageError(f"{_OPTION} is for --raw")
    from mocap_jax.simulation.raw import RawOptions

    given = {}
    for text in arguments.raw_set:
        name, _, value = text.partition("=")
        if name not in RawOptions.__dataclass_fields__:
            raise unknown_choice(_OPTION, "name", name, RawOptions.__dataclass_fields__)
        try:
            given[name] = float(value)
        except ValueError as error:
            raise UsageError(f"{_OPTION} {text}: expected NAME=NUMBER") from error
    with value_of(_OPTION):
        return RawOptions(**given)

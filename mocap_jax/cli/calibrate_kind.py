"""What the kinds of `mocap-jax calibrate` share: their parsers, input and set-up files."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocap_jax.recording import Recording

Kinds = Any  # argparse's class of sub-parsers is private


def add_kind(
    kinds: Kinds,
    name: str,
    *,
    summary: str,
    example: str,
    note: str,
    run: Callable[[argparse.Namespace], int],
) -> argparse.ArgumentParser:
    """Add the parser of a kind.

    Args:
        kinds: what `add_subparsers` returned.
        name: of the kind.
        summary: one line, no full stop.
        example: a command.
        note: how to record for it.
        run: takes the arguments and returns the exit code.
    """
    parser = kinds.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog=f"example:\n  {example}\n\n{note}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    # SUPPRESS: a default here would undo what stood in front of the kind's name.
    parser.add_argument(
        "--traceback", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS
    )
    parser.set_defaults(calibrate=run)
    return parser


def add_recordings(parser: argparse.ArgumentParser, *, nargs: str = "+") -> None:
    """The argument for recordings."""
    parser.add_argument("recordings", metavar="REC", nargs=nargs, help="recordings (.mcap)")


def add_output(parser: argparse.ArgumentParser) -> None:
    """The argument for the set-up file."""
    parser.add_argument(
        "-o", "--output", metavar="SETUP.toml",
        help="set-up file to write the figures to; made, or completed: its other entries stay",
    )  # fmt: skip


def read_recordings(paths: list[str]) -> list[Recording]:
    """Read recordings, and say on stderr what damaged ones lost."""
    from mocap_jax.cli.files import read_input

    return [read_input(path) for path in paths]

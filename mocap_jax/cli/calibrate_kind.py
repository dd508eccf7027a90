"""What the kinds of `mocap-jax calibrate` share: parsers, input, and where figures go."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.cli.files import output_file, read_input
from mocap_jax.cli.parser import add_json_argument
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.io import SetupFigures
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


def add_recordings(parser: argparse.ArgumentParser) -> None:
    """The argument for recordings."""
    parser.add_argument("recordings", metavar="REC", nargs="+", help="recordings (.mcap)")


def add_outputs(parser: argparse.ArgumentParser) -> None:
    """The arguments for the set-up file and for JSON."""
    parser.add_argument(
        "-o", "--output", metavar="SETUP.toml",
        help="set-up file to write the figures to; made, or completed: its other entries stay",
    )  # fmt: skip
    add_json_argument(parser)


def check_outputs(arguments: argparse.Namespace) -> None:
    """Refuse output files that could not be written, before any work."""
    if arguments.json:
        output_file(arguments.json)
    if arguments.output:
        file = output_file(arguments.output, (".toml",))
        if file.exists():
            from mocap_jax.io import read_setup_figures

            read_setup_figures(file, may_be_empty=True)


def read_recordings(paths: list[str]) -> list[Recording]:
    """Read recordings, and say on stderr what damaged ones lost."""
    return [read_input(path) for path in paths]


@contextmanager
def about(paths: list[str]) -> Iterator[None]:
    """Put the names of the files in front of an input error about what is in them.

    Wrong usage is not about the files: it stays as it is.
    """
    try:
        yield
    except UsageError:
        raise
    except InputError as error:
        names = ", ".join(paths[:3]) + (f" and {len(paths) - 3} more" if len(paths) > 3 else "")
        raise InputError(f"{names}: {error}") from error


def warn(sensors: dict[str, str]) -> None:
    """Say on stderr which sensors were left out, and why."""
    for name, reason in sensors.items():
        print(f"mocap-jax: warning: sensor '{name}' is left out: {reason}", file=sys.stderr)


def write_figures(
    arguments: argparse.Namespace, figures: SetupFigures, results: dict[str, Any]
) -> None:
    """Write the set-up file and the JSON file where they are asked for."""
    if arguments.output:
        from mocap_jax.io import update_setup_file

        update_setup_file(arguments.output, figures)
        print(f"wrote {arguments.output}")
    if arguments.json:
        from mocap_jax.cli.results import write_json

        write_json(Path(arguments.json), results)

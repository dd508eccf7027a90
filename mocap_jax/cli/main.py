"""Entry point: parse, run one verb, turn every failure into one line and an exit code."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from types import ModuleType

from mocap_jax import __version__
from mocap_jax.cli import (
    batch,
    calibrate,
    convert,
    cut,
    decode,
    demo,
    evaluate,
    export,
    info,
    place,
    reconstruct,
    report,
    simulate,
    view,
)
from mocap_jax.cli.exit_codes import FAILURE, USAGE, UsageError
from mocap_jax.cli.files import keep_inputs
from mocap_jax.cli.parser import Parser, add_common_arguments
from mocap_jax.cli.process import prepare_process
from mocap_jax.errors import MocapError

VERBS: dict[str, ModuleType] = {
    "demo": demo,
    "simulate": simulate,
    "decode": decode,
    "calibrate": calibrate,
    "convert": convert,
    "cut": cut,
    "reconstruct": reconstruct,
    "batch": batch,
    "place": place,
    "evaluate": evaluate,
    "info": info,
    "export": export,
    "report": report,
    "view": view,
}
"""Each module gives `SUMMARY`, `EXAMPLE`, `add_arguments(parser)`, `run(arguments) -> int` and, if
its help says more, `NOTE`."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        argv: arguments without the program's name; default those of the process.

    Returns:
        0 success, 1 failure, 2 wrong usage, 3 result usable but made from damaged input.
    """
    try:
        arguments = build_parser().parse_args(argv)
    except SystemExit as end:  # argparse ends the process for --help and for wrong usage
        return int(end.code or 0)
    show_traceback = arguments.traceback or bool(os.environ.get("MOCAP_JAX_TRACEBACK"))
    try:
        keep_inputs(arguments)
        prepare_process()
        return arguments.run(arguments)
    except BrokenPipeError:  # the reader of our output (`| head`) has gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILURE
    except KeyboardInterrupt:
        print("mocap-jax: interrupted", file=sys.stderr)
        return 128 + signal.SIGINT
    except Exception as error:
        if show_traceback:
            traceback.print_exc()
        else:
            print(f"mocap-jax: error: {describe(error)}", file=sys.stderr)
        return USAGE if isinstance(error, UsageError) else FAILURE


def build_parser() -> argparse.ArgumentParser:
    """The parser of all verbs."""
    parser = Parser(
        prog="mocap-jax",
        description="Human motion from body-worn inertial and ultrasonic sensors.",
        epilog="Exit codes: 0 success, 1 failure, 2 wrong usage, 3 result made from damaged input. "
        "`mocap-jax VERB --help` explains a verb and gives an example.",
    )
    parser.add_argument("--version", action="version", version=f"mocap-jax {__version__}")
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True)
    for name, module in VERBS.items():
        verb = verbs.add_parser(
            name,
            help=module.SUMMARY,
            description=module.SUMMARY[0].upper() + module.SUMMARY[1:] + ".",
            epilog=f"example:\n  {module.EXAMPLE}" + _note(module),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        module.add_arguments(verb)
        add_common_arguments(verb)
        verb.set_defaults(run=module.run)
    return parser


def _note(module: ModuleType) -> str:
    note = getattr(module, "NOTE", "")
    return f"\n\n{note}" if note else ""


def describe(error: Exception) -> str:
    """One line about an error, with a hint where it is not one of ours."""
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror or error}"
    text = " ".join(str(error).split())
    if isinstance(error, MocapError):
        return text
    if isinstance(error, MemoryError):
        return "not enough memory; use a shorter recording or fewer sensors"
    return (
        f"unexpected {type(error).__name__}: {text[:300]} "
        "(add --traceback to see where, and please report it)"
    )

"""Argument parsing shared by the verbs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import NoReturn

from mocap_jax.cli.exit_codes import USAGE

SENSOR_KINDS = {
    "A": "accelerometer",
    "G": "gyroscope",
    "D": "distance",
    "O": "orientation",
    "M": "magnetometer",
}


class Parser(argparse.ArgumentParser):
    """`ArgumentParser` that reports wrong usage on one line."""

    def error(self, message: str) -> NoReturn:
        """Print one line to stderr and exit with the code of wrong usage."""
        print(f"{self.prog}: error: {message} (see {self.prog} --help)", file=sys.stderr)
        raise SystemExit(USAGE)


def add_common_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments that every verb has."""
    parser.add_argument(
        "--traceback", action="store_true", help="on an error, show where in the code it arose"
    )


def add_json_argument(parser: argparse.ArgumentParser) -> None:
    """The argument `--json F`."""
    parser.add_argument("--json", metavar="F", help="also write machine-readable results to F")


def sensor_kinds(text: str) -> str:
    """Read a list of sensor kinds such as "A,G,D" (an argparse type).

    Returns:
        The letters without separators, each once.
    """
    letters = [part.strip().upper() for part in text.replace(",", " ").split()]
    if len(letters) == 1:
        letters = list(letters[0])
    valid = ", ".join(f"{letter} ({kind})" for letter, kind in SENSOR_KINDS.items())
    for letter in letters:
        if letter not in SENSOR_KINDS:
            raise argparse.ArgumentTypeError(f"unknown sensor kind '{letter}'; valid: {valid}")
    if not letters:
        raise argparse.ArgumentTypeError(f"no sensor kind given; valid: {valid}")
    return "".join(dict.fromkeys(letters))


def positive_float(text: str) -> float:
    """Read a number above zero (an argparse type)."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above zero")
    return value


def number_between(low: float, high: float) -> Callable[[str], float]:
    """Make an argparse type that reads a number of a range, both ends included."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"'{text}' is not a number from {low:g} to {high:g}")
        return value

    return read


def count(text: str) -> int:
    """Read an integer, zero or more (an argparse type)."""
    try:
        value = int(text)
    except ValueError:
        value = -1
    if value < 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not an integer of zero or more")
    return value


def positive_count(text: str) -> int:
    """Read an integer, one or more (an argparse type)."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not an integer of 1 or more")
    return value


def seconds(text: str) -> float:
    """Read a time of a recording, zero or more (an argparse type)."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"'{text}' is not a time in seconds, zero or more")
    return value

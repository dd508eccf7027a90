"""Stretches of time on the command line: `walk.amc:2-7`, `--from 2 --to 7`."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.cli.parser import seconds
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.motion import Motion
    from mocap_jax.recording import Recording

_STRETCH = re.compile(r"(?P<name>.+):(?P<start>\d+(\.\d*)?|\.\d+)-(?P<stop>\d+(\.\d*)?|\.\d+)")


def named_stretch(text: str) -> tuple[str, tuple[float, float] | None]:
    """`walk.amc:2-7` is the stretch of `walk.amc` from 2 to 7 s; a file of that very name is not.

    Raises:
        UsageError: the stretch ends before it starts.
    """
    found = _STRETCH.fullmatch(text)
    if found is None or Path(text).exists():
        return text, None
    start, stop = float(found["start"]), float(found["stop"])
    if start >= stop:
        raise UsageError(f"{text}: a stretch must end after it starts, as {found['name']}:2-7")
    return found["name"], (start, stop)


def with_stretch(motion: Motion, stretch: tuple[float, float] | None) -> Motion:
    """The motion, or the stretch of it that was asked for."""
    from mocap_jax.motion import cut_motion

    return motion if stretch is None else cut_motion(motion, *stretch)


def add_cut_arguments(parser: argparse.ArgumentParser) -> None:
    """`--from S` and `--to S`."""
    parser.add_argument(
        "--from", dest="start", type=seconds, metavar="S",
        help="leave out what is before this time of the recording [s]",
    )  # fmt: skip
    parser.add_argument(
        "--to", dest="stop", type=seconds, metavar="S", help="leave out what is after it [s]"
    )


class Asked(Protocol):
    """Arguments of `add_cut_arguments`, parsed."""

    @property
    def start(self) -> float | None:
        """[s]"""

    @property
    def stop(self) -> float | None:
        """[s]"""


def cut_as_asked(
    arguments: Asked | argparse.Namespace, recording: Recording, path: str
) -> Recording:
    """The recording, or what `--from` and `--to` leave of it.

    Raises:
        UsageError: times that are not in order, or between which nothing was measured.
    """
    if arguments.start is None and arguments.stop is None:
        return recording
    from mocap_jax.recording import cut

    option = " ".join(
        f"{o} {t:g}" for o, t in (("--from", arguments.start), ("--to", arguments.stop))
        if t is not None
    )  # fmt: skip
    try:
        return cut(recording, arguments.start, arguments.stop)
    except InputError as error:
        raise UsageError(f"{path}: {option}: {str(error).removeprefix('cut: ')}") from error


def cut_remarks(whole: Recording, part: Recording) -> tuple[str, ...]:
    """What cutting took from a recording that its estimate needs, in sentences."""
    if part is whole:
        return ()
    lines = []
    start, stop = part.interval
    if whole.setup.rest is not None and part.setup.rest is None:
        rest = whole.setup.rest
        lines.append(
            f"The rest hold ({rest.start:g} to {rest.end:g} s) was cut away: offsets and mounting "
            "of the sensors cannot be read from it."
        )
    if lost := [n for n in whole.inertial if n not in part.inertial]:
        lines.append(f"No samples from {start:.2f} s to {stop:.2f} s: {', '.join(lost)}.")
    return tuple(lines)

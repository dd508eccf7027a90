"""The option `--setup SETUP.toml`: noise and calibration of the sensors."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mocap_jax.io import SetupFigures
    from mocap_jax.recording import Recording, Setup


def add_setup_argument(parser: argparse.ArgumentParser, use: str) -> None:
    """Add the option; `use` says what becomes of the figures."""
    parser.add_argument(
        "--setup", metavar="SETUP.toml",
        help=f"noise and calibration of the sensors (see mocap-jax calibrate): {use}",
    )  # fmt: skip


def warn_on_stderr(text: str) -> None:
    """Tell a warning."""
    print(f"mocap-jax: warning: {text}", file=sys.stderr)


def setup_figures(arguments: argparse.Namespace, worn: str | None = None) -> SetupFigures | None:
    """What the set-up file says; None without the option.

    Args:
        arguments: of the verb.
        worn: suit file, which may hold the figures itself.
    """
    if worn and not arguments.setup:
        arguments.setup = worn
    if not arguments.setup:
        return None
    from mocap_jax.io import read_setup_figures

    return read_setup_figures(arguments.setup)


def corrected(
    setup: str | None, recording: Recording, warn: Callable[[str], None] = warn_on_stderr
) -> Recording:
    """The recording with the figures of a set-up file; as it is without one.

    Args:
        setup: the file of `--setup`.
        recording: any.
        warn: told names of the calibration that nobody bears.
    """
    if not setup:
        return recording
    from mocap_jax.io import read_setup_figures
    from mocap_jax.recording import with_calibration

    figures = read_setup_figures(setup)
    for text in strangers(setup, figures, recording.setup, tuple(recording.inertial)):
        warn(text)
    return with_calibration(recording, figures.calibration, figures.noise)


def strangers(
    file: str, figures: SetupFigures, setup: Setup, sensors: tuple[str, ...]
) -> tuple[str, ...]:
    """Which names of a file's calibration nobody here bears, in sentences: they may be misspelt."""
    from mocap_jax.recording.calibration import same_source

    calibration, out = figures.calibration, []
    for what, names, known in (
        ("sensor", {**calibration.accelerometer, **calibration.gyroscope}, sensors),
        ("source", calibration.source_offset, setup.sources),
    ):
        same = same_source if what == "source" else str.__eq__
        unknown = [name for name in names if not any(same(name, other) for other in known)]
        if unknown and known:
            out.append(
                f"{file}: calibrates {what} {', '.join(unknown)}, which is not worn; there are: "
                f"{', '.join(known)}"
            )
    return tuple(out)

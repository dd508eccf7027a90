"""The option `--setup SETUP.toml`: noise and calibration of the sensors."""

from __future__ import annotations

import argparse
import sys
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


def corrected(arguments: argparse.Namespace, recording: Recording) -> Recording:
    """The recording with the figures of `--setup`, if that was given."""
    figures = setup_figures(arguments)
    if figures is None:
        return recording
    from mocap_jax.recording import with_calibration

    warn_of_strangers(arguments, figures, recording.setup, tuple(recording.inertial))
    return with_calibration(recording, figures.calibration, figures.noise)


def warn_of_strangers(
    arguments: argparse.Namespace, figures: SetupFigures, setup: Setup, sensors: tuple[str, ...]
) -> None:
    """Say on stderr which names of the calibration nobody here bears: they may be misspelt."""
    from mocap_jax.recording.calibration import same_source

    calibration = figures.calibration
    for what, names, known in (
        ("sensor", {**calibration.accelerometer, **calibration.gyroscope}, sensors),
        ("source", calibration.source_offset, setup.sources),
    ):
        same = same_source if what == "source" else str.__eq__
        strangers = [name for name in names if not any(same(name, other) for other in known)]
        if strangers and known:
            print(
                f"mocap-jax: warning: {arguments.setup}: calibrates {what} "
                f"{', '.join(strangers)}, which is not worn; there are: {', '.join(known)}",
                file=sys.stderr,
            )

"""How to estimate: arguments that `reconstruct` and `batch` share, and what they ask for."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

from mocap_jax.cli.exit_codes import UsageError, unknown_choice
from mocap_jax.cli.human_text import HUMAN_FORM, is_human, read_human
from mocap_jax.cli.methods import FILTERS, METHODS, PRESETS, Preset
from mocap_jax.cli.parser import sensor_kinds
from mocap_jax.cli.setup_choice import add_setup_argument
from mocap_jax.cli.skeleton import check_body
from mocap_jax.cli.stretch import add_cut_arguments


@dataclass(frozen=True)
class Estimation:
    """What was asked for; None keeps what the preset or the recording says."""

    body: str | None = None
    """MJCF file, OpenSim model or `human:...`."""
    method: str | None = None
    smooth: bool = False
    sensors: str | None = None
    root: str | None = None
    contacts: bool = False
    gravity: bool = False
    preset: str | None = None
    initial: str | None = None
    """Solution file to start from; of a batch the folder of them."""
    setup: str | None = None
    """Set-up file whose noise and calibration replace the recording's."""
    start: float | None = None
    """[s]"""
    stop: float | None = None
    """[s]"""

    @property
    def chosen(self) -> Preset:
        """The preset."""
        return PRESETS[self.preset or "default"]


def add_estimation_arguments(parser: argparse.ArgumentParser, initial: str) -> None:
    """Arguments that say how to estimate.

    Args:
        parser: of the verb.
        initial: what `--initial` names: FILE or DIR.
    """
    parser.add_argument(
        "--body", metavar="XML",
        help=f"MJCF body or OpenSim model (.osim) with the sensors' sites, a skeleton of joint "
        f"positions (.json, .npz, .csv) that gets them, or {HUMAN_FORM} (the "
        "built-in one, which wears the sensors where the recording says); default: the recording's",
    )  # fmt: skip
    parser.add_argument(
        "--method", metavar="NAME",
        help="optimise (default: smoothed filter, then the whole sequence at once), ekf (extended "
        "Kalman filter), ukf (unscented), or orientation (the whole sequence from measured "
        "orientations alone)",
    )  # fmt: skip
    parser.add_argument(
        "--smooth", action="store_true",
        help="with --method ekf or ukf: smooth the filter's estimate",
    )  # fmt: skip
    what = "solution" if initial == "FILE" else "solutions NAME.solution.mcap"
    parser.add_argument(
        "--initial", metavar=initial,
        help=f"with --method optimise or orientation: start from {what} in {initial} instead of "
        "the filter",
    )  # fmt: skip
    parser.add_argument(
        "--sensors", type=sensor_kinds, metavar="A,G,D,O,M",
        help="measurements to use: accelerometer, gyroscope, distance, orientation, magnetometer "
        "(default: all but the last)",
    )  # fmt: skip
    parser.add_argument(
        "--root", choices=("given", "free"),
        help="whether the recorded root pose is used (default: given when the recording has it)",
    )  # fmt: skip
    parser.add_argument(
        "--contacts", action="store_true",
        help="with --method optimise: feet that stand on the ground do not move, so that a free "
        "root hardly drifts",
    )  # fmt: skip
    parser.add_argument(
        "--gravity", action="store_true",
        help="boards that do not accelerate tell tilt, whether or not A is among the measurements "
        "used",
    )  # fmt: skip
    parser.add_argument(
        "--preset", metavar="NAME",
        help="; ".join(f"{name}: {preset.summary}" for name, preset in PRESETS.items()),
    )  # fmt: skip
    add_setup_argument(parser, "readings are corrected by it")
    add_cut_arguments(parser)


def estimation_of(arguments: argparse.Namespace) -> Estimation:
    """What the arguments ask for.

    Raises:
        UsageError: unknown choices, or such as do not go together.
    """
    if arguments.method is not None and arguments.method not in METHODS:
        raise unknown_choice("--method", "method", arguments.method, METHODS)
    if arguments.preset is not None and arguments.preset not in PRESETS:
        raise unknown_choice("--preset", "preset", arguments.preset, PRESETS)
    method = arguments.method or PRESETS[arguments.preset or "default"].method
    if method == "orientation" and arguments.sensors not in (None, "O"):
        raise UsageError(
            "--method orientation uses measured orientations alone; valid: --sensors O"
        )
    if arguments.smooth and method not in FILTERS:
        raise UsageError(f"--smooth belongs to --method ekf or ukf, not to {method}")
    if arguments.contacts and method != "optimise":
        raise UsageError(f"--contacts belongs to --method optimise, not to {method}")
    if arguments.gravity and method == "orientation":
        raise UsageError("--gravity belongs to --method optimise, ekf or ukf, not to orientation")
    if arguments.initial is not None and method in FILTERS:
        raise UsageError(f"--initial belongs to --method optimise or orientation, not to {method}")
    if is_human(arguments.body):
        read_human(arguments.body)
    elif arguments.body:
        check_body(arguments.body)
    # A path is kept whole: workers of a batch may run elsewhere.
    whole = lambda path: None if path is None else str(Path(path).absolute())  # noqa: E731
    body = arguments.body
    return Estimation(
        body=body if is_human(body) else whole(body),
        method=arguments.method,
        smooth=arguments.smooth,
        sensors=arguments.sensors,
        root=arguments.root,
        contacts=arguments.contacts,
        gravity=arguments.gravity,
        preset=arguments.preset,
        initial=whole(arguments.initial),
        setup=whole(arguments.setup or None),
        start=arguments.start,
        stop=arguments.stop,
    )

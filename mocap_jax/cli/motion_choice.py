"""The argument MOTION of `simulate`: a motion file or a built-in motion, and who performs it."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mocap_jax.cli.body_choice import add_body_arguments, chosen_body
from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.cli.human_text import is_human
from mocap_jax.cli.parser import count, number_between
from mocap_jax.cli.stretch import named_stretch, with_stretch
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.body import Body
    from mocap_jax.motion import Motion

FILE_OPTIONS: tuple[tuple[str, Callable[[str], Any], str], ...] = (
    ("skeleton", str, "ASF"),
    ("fps", number_between(1, 1e4), "HZ"),
    ("scale", number_between(1e-4, 10), "M"),
    ("skip", count, "N"),
)
"""How a motion file is read: name, type and placeholder of each argument."""
_HELP = {
    "skeleton": "skeleton of an .amc file elsewhere",
    "fps": "true frame rate",
    "scale": "metres per file unit",
    "skip": "leading frames to leave out",
}


def add_motion_arguments(parser: argparse.ArgumentParser) -> None:
    """How a motion file is read, and the body that performs it."""
    add_body_arguments(parser)
    for option, kind, metavar in FILE_OPTIONS:
        parser.add_argument(f"--{option}", type=kind, metavar=metavar, help=_HELP[option])


def chosen_motion(arguments: argparse.Namespace) -> Motion:
    """The motion asked for, on the body asked for; prints how well it was retargeted.

    Raises:
        UsageError: options that do not go with the motion.
        InputError: neither a motion file that can be read nor a built-in motion.
    """
    from mocap_jax.motion import BUILTIN_MOTIONS, builtin_motion, load_motion

    arguments.motion, stretch = named_stretch(arguments.motion)
    if arguments.motion in BUILTIN_MOTIONS:
        _refuse_file_options(arguments)
        body = chosen_body(arguments)
        own = arguments.body is None or is_human(arguments.body)
        if arguments.motion == "routine" or own:
            return with_stretch(builtin_motion(arguments.motion, body), stretch)
        return _on_body(with_stretch(builtin_motion(arguments.motion), stretch), body)
    if Path(arguments.motion).is_dir():  # also the empty name
        raise InputError(f"'{arguments.motion}': this is a folder; name a motion file in it")
    if not Path(arguments.motion).exists() and not Path(arguments.motion).suffix:
        known = ", ".join(BUILTIN_MOTIONS)
        raise InputError(
            f"{arguments.motion}: neither a file nor a built-in motion; built in: {known} (a "
            "stretch of one, in seconds: walking:2-7)"
        )
    _refuse_options_of_other_files(arguments)
    options = {
        "skeleton": arguments.skeleton, "fps": arguments.fps, "scale": arguments.scale,
    }  # fmt: skip
    try:
        motion = load_motion(arguments.motion, **options, skip=arguments.skip)
    except InputError as error:
        if not arguments.skip:
            raise
        load_motion(arguments.motion, **options)  # a fault of the file itself is raised here
        raise UsageError(f"--skip {arguments.skip}: {error}") from error
    return _on_body(with_stretch(motion, stretch), chosen_body(arguments, motion))


def _on_body(motion: Motion, body: Body | None) -> Motion:
    """The motion retargeted to a body, if one is given; prints how well that went."""
    if body is None:
        return motion
    from mocap_jax.motion import retarget, retarget_errors, retarget_table

    fitted = retarget(motion, body)
    print(f"retargeted to another body, leg lengths {fitted.facts['scale']:.3f} times the clip's:")
    print(retarget_table(retarget_errors(motion, fitted)))
    return fitted


def _refuse_file_options(arguments: argparse.Namespace) -> None:
    given = [o for o, _, _ in FILE_OPTIONS if getattr(arguments, o) is not None]
    if given:
        raise UsageError(
            f"--{given[0]} is for motion files, '{arguments.motion}' is a built-in motion"
        )


def _refuse_options_of_other_files(arguments: argparse.Namespace) -> None:
    from mocap_jax.motion import SCALED_SUFFIXES, SKELETON_SUFFIXES

    suffix = Path(arguments.motion).suffix.lower()
    for option, valid in (("skeleton", SKELETON_SUFFIXES), ("scale", SCALED_SUFFIXES)):
        if getattr(arguments, option) is not None and suffix not in valid:
            raise UsageError(
                f"--{option} is for {' and '.join(valid)} clips, not for '{arguments.motion}'"
            )

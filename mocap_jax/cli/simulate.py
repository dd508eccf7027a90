"""`mocap-jax simulate`: a known motion to a recording with its ground truth."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

from mocap_jax.cli.body_choice import add_body_arguments, chosen_body
from mocap_jax.cli.exit_codes import SUCCESS, UsageError, unknown_choice
from mocap_jax.cli.files import output_file
from mocap_jax.cli.human_text import is_human
from mocap_jax.cli.parser import count, number_between
from mocap_jax.cli.setup_choice import (
    add_setup_argument,
    setup_figures,
    strangers,
    warn_on_stderr,
)
from mocap_jax.cli.simulation_choices import (
    add_recording_arguments,
    refuse_for_raw,
    simulation_options,
)
from mocap_jax.cli.stretch import named_stretch, with_stretch
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.body import Body
    from mocap_jax.io import SetupFigures
    from mocap_jax.motion import Motion
    from mocap_jax.simulation import Profile, SimulationOptions, Suit

SUMMARY = "simulate the sensors of a person who performs a known motion"
EXAMPLE = "mocap-jax simulate walking:0-3 -o walk.mcap --profile field --seed 1"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument(
        "motion",
        metavar="MOTION",
        help="motion file (.amc with its .asf beside it, .bvh, .npz) or a built-in motion: "
        "routine, walking; NAME:START-END takes a stretch of it [s]",
    )
    parser.add_argument("-o", "--output", metavar="REC", required=True, help="recording to write")
    parser.add_argument(
        "--sensors", metavar="SETUP.toml",
        help="suit to wear: a set-up file, or sip6_head, sip6_tnt15 (six boards) or tnt15 (ten); "
        "default: 18 boards, 8 sources",
    )  # fmt: skip
    parser.add_argument(
        "--profile",
        default="paper",
        metavar="NAME",
        help="ideal (no errors), paper (white noise as published; default) or field "
        "(bias, mounting errors, soft tissue, outliers, ...)",
    )
    add_setup_argument(parser, "readings err by it, and the set-up says so (default: --sensors')")
    parser.add_argument("--seed", type=count, default=0, metavar="N", help="of all random errors")
    parser.add_argument(
        "--raw", action="store_true",
        help="write what the driver box samples (5 MB a second); see mocap-jax decode",
    )  # fmt: skip
    add_body_arguments(parser)
    parser.add_argument("--skeleton", metavar="ASF", help="skeleton of an .amc file elsewhere")
    parser.add_argument("--fps", type=number_between(1, 1e4), metavar="HZ", help="true frame rate")
    parser.add_argument(
        "--scale", type=number_between(1e-4, 10), metavar="M", help="metres per file unit"
    )
    parser.add_argument("--skip", type=count, metavar="N", help="leading frames to leave out")
    add_recording_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    output = output_file(arguments.output, (".mcap",))
    if arguments.raw:
        refuse_for_raw(arguments)
    from mocap_jax.io import write_recording
    from mocap_jax.simulation import PROFILES, SUITS, load_suit, named_suit, simulate
    from mocap_jax.simulation.mounting import with_shapes

    if arguments.profile not in PROFILES:
        raise unknown_choice("--profile", "profile", arguments.profile, PROFILES)
    options = simulation_options(arguments)
    motion = _load_motion(arguments)
    suit = None
    if arguments.sensors:
        if arguments.sensors not in SUITS and not Path(arguments.sensors).is_file():
            raise InputError(
                f"{arguments.sensors}: neither a set-up file nor a suit; suits: {', '.join(SUITS)}"
            )
        read = named_suit if arguments.sensors in SUITS else load_suit
        suit = read(arguments.sensors, with_shapes(motion.body))
    worn = arguments.sensors if suit is not None and arguments.sensors not in SUITS else None
    figures = setup_figures(arguments, worn)
    if arguments.raw:
        return _run_raw(arguments, output, motion, suit, options, figures)
    profile = _profile(arguments.profile, figures)
    recording = simulate(
        motion, profile=profile, seed=arguments.seed, suit=suit, options=options,
        calibration=None if figures is None else figures.calibration,
    )  # fmt: skip
    if figures is not None:
        for text in strangers(arguments.setup, figures, recording.setup, tuple(recording.inertial)):
            warn_on_stderr(text)
    write_recording(output, recording)
    start, end = recording.interval
    print(
        f"{output}: {motion.name}, {end - start:.1f} s, {len(recording.inertial)} boards, "
        f"{len(recording.setup.sources)} sources, profile {arguments.profile}, "
        f"seed {arguments.seed}"
    )
    return SUCCESS


def _run_raw(
    arguments: argparse.Namespace,
    output: Path,
    motion: Motion,
    suit: Suit | None,
    options: SimulationOptions,
    figures: SetupFigures | None,
) -> int:
    """Write the raw recording of a motion."""
    from tqdm import tqdm

    from mocap_jax.simulation.raw import simulate_raw

    profile = _profile(arguments.profile, figures)
    raw = simulate_raw(
        motion, profile=profile, seed=arguments.seed, suit=suit, options=options,
        calibration=None if figures is None else figures.calibration,
    )  # fmt: skip
    if figures is not None:
        for text in strangers(arguments.setup, figures, raw.recording.setup, raw.wires):
            warn_on_stderr(text)
    pieces = tqdm(raw.chunks(), desc="simulate", total=raw.pieces, disable=None)
    raw.write(output, pieces)
    print(
        f"{output}: {motion.name}, {raw.duration:.1f} s raw, {len(raw.wires)} boards, "
        f"{len(raw.recording.setup.sources)} sources, profile {arguments.profile}, "
        f"seed {arguments.seed}"
    )
    return SUCCESS


def _profile(name: str, figures: SetupFigures | None) -> Profile:
    """The profile, with the noise that a set-up file measured."""
    from mocap_jax.simulation.profiles import profile_named

    profile = profile_named(name)
    if figures is None:
        return profile
    return dataclasses.replace(profile, stated=dataclasses.replace(profile.stated, **figures.noise))


def _load_motion(arguments: argparse.Namespace) -> Motion:
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
    given = [o for o in ("skeleton", "fps", "scale", "skip") if getattr(arguments, o) is not None]
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

"""`mocap-jax simulate`: a known motion to a recording with its ground truth."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import SUCCESS, unknown_choice
from mocap_jax.cli.far_anchors import far_anchors, unheard_anchors
from mocap_jax.cli.files import output_file
from mocap_jax.cli.motion_choice import add_motion_arguments, chosen_motion
from mocap_jax.cli.parser import count
from mocap_jax.cli.people import add_people_arguments, check_people, people
from mocap_jax.cli.people_figures import everybodys_figures
from mocap_jax.cli.raw_choices import add_raw_arguments, raw_options
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
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.body import Body
    from mocap_jax.io import SetupFigures
    from mocap_jax.motion import Motion
    from mocap_jax.simulation import Profile, SimulationOptions, Suit
    from mocap_jax.simulation.raw import RawOptions

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
    add_raw_arguments(parser)
    add_motion_arguments(parser)
    add_people_arguments(parser)
    add_recording_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    output = output_file(arguments.output, (".mcap",))
    if arguments.raw:
        refuse_for_raw(arguments)
    from mocap_jax.io import write_recording
    from mocap_jax.simulation import PROFILES, SUITS, simulate

    if arguments.profile not in PROFILES:
        raise unknown_choice("--profile", "profile", arguments.profile, PROFILES)
    options, wires = simulation_options(arguments), raw_options(arguments)
    check_people(arguments)
    motion = chosen_motion(arguments)
    suit = None if arguments.others else _suit(arguments, motion.body)
    if arguments.others:
        motion, suit = people(arguments, motion, _suit)
    worn = arguments.sensors if arguments.sensors not in (None, *SUITS) else None
    figures = setup_figures(arguments, worn)
    if figures is not None and suit is not None and arguments.others and arguments.setup == worn:
        figures = everybodys_figures(figures, suit)
    if arguments.raw:
        return _run_raw(arguments, output, motion, suit, options, wires, figures)
    profile = _profile(arguments.profile, figures)
    recording = simulate(
        motion, profile=profile, seed=arguments.seed, suit=suit, options=options,
        calibration=None if figures is None else figures.calibration,
    )  # fmt: skip
    if figures is not None:
        for text in strangers(arguments.setup, figures, recording.setup, tuple(recording.inertial)):
            warn_on_stderr(text)
    for text in unheard_anchors(recording.ranges, options, limited=arguments.max_range is not None):
        warn_on_stderr(text)
    write_recording(output, recording)
    start, end = recording.interval
    print(
        f"{output}: {motion.name}, {end - start:.1f} s, {len(recording.inertial)} boards, "
        f"{len(recording.setup.sources)} sources, profile {arguments.profile}, "
        f"seed {arguments.seed}"
    )
    return SUCCESS


def _suit(arguments: argparse.Namespace, body: Body) -> Suit | None:
    """The suit of `--sensors` on a body; None for the standard one.

    Raises:
        InputError: no such suit, or one that does not fit.
    """
    from mocap_jax.simulation import SUITS, load_suit, named_suit
    from mocap_jax.simulation.mounting import with_shapes

    if not arguments.sensors:
        return None
    if arguments.sensors not in SUITS and not Path(arguments.sensors).is_file():
        raise InputError(
            f"{arguments.sensors}: neither a set-up file nor a suit; suits: {', '.join(SUITS)}"
        )
    read = named_suit if arguments.sensors in SUITS else load_suit
    return read(arguments.sensors, with_shapes(body))


def _run_raw(
    arguments: argparse.Namespace,
    output: Path,
    motion: Motion,
    suit: Suit | None,
    options: SimulationOptions,
    wires: RawOptions,
    figures: SetupFigures | None,
) -> int:
    """Write the raw recording of a motion."""
    from tqdm import tqdm

    from mocap_jax.simulation.raw import simulate_raw

    profile = _profile(arguments.profile, figures)
    raw = simulate_raw(
        motion, profile=profile, seed=arguments.seed, suit=suit, options=options,
        raw=wires, calibration=None if figures is None else figures.calibration,
    )  # fmt: skip
    if figures is not None:
        boards = tuple(s.name for s in raw.recording.setup.sensors)
        for text in strangers(arguments.setup, figures, raw.recording.setup, boards):
            warn_on_stderr(text)
    for text in far_anchors(raw, options):
        warn_on_stderr(text)
    pieces = tqdm(raw.chunks(), desc="simulate", total=raw.pieces, disable=None)
    raw.write(output, pieces)
    print(
        f"{output}: {motion.name}, {raw.duration:.1f} s raw, {len(raw.boards)} boards, "
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

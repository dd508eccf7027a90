"""`mocap-jax reconstruct`: recording in, solution out."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import FAILURE, UsageError, unknown_choice
from mocap_jax.cli.files import exit_code, output_file, read_input
from mocap_jax.cli.human_text import HUMAN_FORM, human_of, is_human, read_human
from mocap_jax.cli.methods import METHODS, PRESETS, solve
from mocap_jax.cli.parser import add_json_argument, sensor_kinds
from mocap_jax.cli.results import (
    describe_solution,
    ends_before_scores,
    errors_against_truth,
    to_json,
    write_json,
)
from mocap_jax.cli.stretch import add_cut_arguments, cut_as_asked, cut_remarks
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.body import Body
    from mocap_jax.recording import Recording

SUMMARY = "estimate the motion in a recording"
EXAMPLE = "mocap-jax reconstruct walk.mcap --method optimise --sensors A,G,D --json walk.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument("recording", metavar="REC", help="recording (.mcap)")
    parser.add_argument(
        "-o", "--output", metavar="OUT", help="solution to write (default: REC.solution.mcap)"
    )
    parser.add_argument(
        "--body",
        metavar="XML",
        help=f"MJCF body or OpenSim model (.osim) with the sensors' sites, or {HUMAN_FORM} (the "
        "built-in one, which wears the sensors where the recording says); default: the recording's",
    )
    parser.add_argument(
        "--method",
        metavar="NAME",
        help="optimise (default: smoothed filter, then the whole sequence at once), ekf, or "
        "orientation (the whole sequence from measured orientations alone)",
    )
    parser.add_argument(
        "--smooth", action="store_true", help="with --method ekf: smooth the filter's estimate"
    )
    parser.add_argument(
        "--sensors",
        type=sensor_kinds,
        metavar="A,G,D,O",
        help="measurements to use: accelerometer, gyroscope, distance, orientation (default: all)",
    )
    parser.add_argument(
        "--root",
        choices=("given", "free"),
        help="whether the recorded root pose is used (default: given when the recording has it)",
    )
    parser.add_argument(
        "--contacts",
        action="store_true",
        help="with --method optimise: feet that stand on the ground do not move, so that a free "
        "root hardly drifts",
    )
    parser.add_argument(
        "--preset",
        metavar="NAME",
        help="; ".join(f"{name}: {preset.summary}" for name, preset in PRESETS.items()),
    )
    add_cut_arguments(parser)
    add_json_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    _check_choices(arguments)
    source = Path(arguments.recording)
    if source.is_dir():  # also the empty name
        raise InputError(f"{source}: this is a folder; name a recording in it")
    output = output_file(
        arguments.output or source.with_name(f"{source.stem}.solution.mcap"), (".mcap",)
    )
    json_file = output_file(arguments.json) if arguments.json else None
    from mocap_jax.io import validate_recording, write_solution

    body = _body(arguments.body)
    whole = read_input(source)
    recording = cut_as_asked(arguments, whole, str(source))
    if is_human(arguments.body):
        recording, body = _dressed(recording, body, source, arguments.body)
    validate_recording(recording, body, name=str(source), body_name=arguments.body or "body.xml")
    _check_root(arguments, recording, source)
    suspicions = _suspicions(recording, body, source)
    preset = PRESETS[arguments.preset or "default"]
    solution = solve(
        recording,
        body,
        method=arguments.method or preset.method,
        kinds=arguments.sensors or preset.kinds,
        root=arguments.root or preset.root,
        process=preset.process,
        smooth=arguments.smooth,
        sparse=preset.sparse,
        contacts=arguments.contacts,
        progress=sys.stderr.isatty(),
    )
    remarks = tuple(dict.fromkeys(
        (*cut_remarks(whole, recording), *suspicions, *solution.remarks, *recording.salvage)
    ))  # fmt: skip
    solution = dataclasses.replace(solution, remarks=remarks)
    print(describe_solution(solution))
    errors = errors_against_truth(solution, recording) if solution.status.ok else None
    if errors is not None:
        print(errors)
    elif recording.truth is not None and ends_before_scores(solution):
        print(f"  no errors: they are scored from {solution.setup.score_from:.2f} s on, "
              "after the end of what could be read")  # fmt: skip
    if json_file is not None:
        write_json(json_file, to_json(solution, errors))
    if not solution.status.ok:
        print(f"mocap-jax: error: {source}: {solution.status.value}", file=sys.stderr)
        return FAILURE
    write_solution(output, solution)
    print(f"wrote {output}")
    return exit_code(recording)


def _body(text: str | None) -> Body | None:
    """The body asked for; None for the recording's."""
    if is_human(text):
        return human_of(read_human(text or ""))
    from mocap_jax.body import load_body

    return load_body(text) if text else None


def _dressed(
    recording: Recording, body: Body | None, source: Path, text: str
) -> tuple[Recording, Body]:
    """The recording on the built-in human, and the human with its sensors."""
    from mocap_jax.body import load_body
    from mocap_jax.conversion import worn_by

    assert body is not None
    try:
        recording = worn_by(recording, body)
    except InputError as error:
        raise InputError(f"{source}: --body {text}: {error}") from error
    return recording, load_body(recording.body_xml or "")


def _suspicions(recording: Recording, body: Body | None, source: Path) -> tuple[str, ...]:
    """Sensors that look swapped, turned, cut short or of wrong unit: said now and in remarks."""
    from mocap_jax.initialise import check_sensors
    from mocap_jax.recording import ragged_ends

    sentences = (*check_sensors(recording, body).sentences, *ragged_ends(recording))
    for sentence in sentences:
        print(f"mocap-jax: warning: {source}: {sentence}", file=sys.stderr)
    return sentences


def _check_choices(arguments: argparse.Namespace) -> None:
    if arguments.method is not None and arguments.method not in METHODS:
        if arguments.method == "ukf":
            raise UsageError(f"--method ukf is not available yet; valid: {', '.join(METHODS)}")
        raise unknown_choice("--method", "method", arguments.method, METHODS)
    if arguments.preset is not None and arguments.preset not in PRESETS:
        raise unknown_choice("--preset", "preset", arguments.preset, PRESETS)
    method = arguments.method or PRESETS[arguments.preset or "default"].method
    if method == "orientation" and arguments.sensors not in (None, "O"):
        raise UsageError(
            "--method orientation uses measured orientations alone; valid: --sensors O"
        )
    if arguments.smooth and method != "ekf":
        raise UsageError(f"--smooth belongs to --method ekf, not to {method}")
    if arguments.contacts and method != "optimise":
        raise UsageError(f"--contacts belongs to --method optimise, not to {method}")


def _check_root(arguments: argparse.Namespace, recording: Recording, source: Path) -> None:
    if arguments.root == "given" and recording.root is None:
        raise UsageError(f"--root given: {source} has no root pose (topic /root); valid: free")

"""`mocap-jax reconstruct`: recording in, solution out."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from mocap_jax.cli.estimate_recording import body_asked_for, estimate_recording
from mocap_jax.cli.estimation import add_estimation_arguments, estimation_of
from mocap_jax.cli.exit_codes import FAILURE, UsageError
from mocap_jax.cli.files import exit_code, output_file, read_input
from mocap_jax.cli.parser import add_json_argument
from mocap_jax.cli.results import describe_solution, ends_before_scores, to_json, write_json
from mocap_jax.errors import InputError

SUMMARY = "estimate the motion in a recording"
EXAMPLE = "mocap-jax reconstruct walk.mcap --method optimise --sensors A,G,D --json walk.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument("recording", metavar="REC", help="recording (.mcap)")
    parser.add_argument(
        "-o", "--output", metavar="OUT", help="solution to write (default: REC.solution.mcap)"
    )
    add_estimation_arguments(parser, initial="FILE")
    add_json_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    asked = estimation_of(arguments)
    source = Path(arguments.recording)
    if source.is_dir():  # also the empty name
        raise InputError(f"{source}: this is a folder; name a recording in it")
    output = output_file(
        arguments.output or source.with_name(f"{source.stem}.solution.mcap"), (".mcap",)
    )
    if asked.initial is not None and output.resolve() == Path(asked.initial).resolve():
        raise UsageError(
            f"{arguments.initial}: --output would overwrite the file that --initial reads; give it "
            "a name of its own"
        )
    json_file = output_file(arguments.json) if arguments.json else None
    from mocap_jax.io import write_solution

    body = body_asked_for(arguments.body)
    recording = read_input(source)
    solution, errors = estimate_recording(
        recording, source, asked, body=body, progress=sys.stderr.isatty(),
        warn=lambda text: print(f"mocap-jax: warning: {source}: {text}", file=sys.stderr),
    )  # fmt: skip
    print(describe_solution(solution))
    if errors is not None:
        print(errors)
    elif solution.status.ok and recording.truth is not None and ends_before_scores(solution):
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

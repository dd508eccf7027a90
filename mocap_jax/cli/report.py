"""`mocap-jax report`: solutions as one HTML page with pictures."""

from __future__ import annotations

import argparse

from mocap_jax.cli.files import exit_code, output_file, read_input, read_solution_input

SUMMARY = "show one or more solutions as one HTML page"
EXAMPLE = "mocap-jax report walk.solution.mcap -o report.html --recording walk.mcap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument(
        "solutions", metavar="SOLUTION", nargs="+", help="solutions of one recording (.mcap)"
    )
    parser.add_argument("-o", "--output", metavar="HTML", required=True, help="page to write")
    parser.add_argument(
        "--recording", metavar="REC", help="recording: adds its truth and the errors against it"
    )


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    output = output_file(arguments.output, (".html", ".htm"))
    from mocap_jax.cli.reference import check_relation
    from mocap_jax.report import write_report

    recording = read_input(arguments.recording) if arguments.recording else None
    solutions = [read_solution_input(path) for path in arguments.solutions]
    for path, solution in zip(arguments.solutions, solutions, strict=True):
        if recording is not None:
            check_relation(path, solution, arguments.recording, recording)
    write_report(output, solutions, recording)
    print(f"wrote {output}")
    return exit_code(*solutions, *([recording] if recording is not None else []))

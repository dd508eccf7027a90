"""`mocap-jax evaluate`: errors of a solution against a reference."""

from __future__ import annotations

import argparse

from mocap_jax.cli.files import exit_code, output_file, read_solution_input
from mocap_jax.cli.parser import add_json_argument
from mocap_jax.cli.results import to_json, write_json

SUMMARY = "compare a solution with a recording's truth or with another solution"
EXAMPLE = "mocap-jax evaluate walk.solution.mcap walk.mcap --json errors.json"

NOTE = """exit codes:
  0  errors were computed, at most with a warning (other sensors, another seed)
  1  no errors: the reference holds no truth, or is of another recording (motion, subject, time,
     body), so that errors against it would mean nothing
  2  wrong usage
  3  errors were computed, from a damaged file"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument("solution", metavar="SOLUTION", help="solution to judge (.mcap)")
    parser.add_argument(
        "reference", metavar="REFERENCE", help="recording with its truth, or another solution"
    )
    add_json_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    json_file = output_file(arguments.json) if arguments.json else None
    from mocap_jax.cli.reference import check_relation, read_reference
    from mocap_jax.metrics import evaluate

    solution = read_solution_input(arguments.solution)
    reference = read_reference(arguments.reference)
    check_relation(arguments.solution, solution, arguments.reference, reference)
    errors = evaluate(solution, reference)
    print(errors)
    if json_file is not None:
        write_json(json_file, to_json(solution, errors))
    return exit_code(solution, reference)

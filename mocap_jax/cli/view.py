"""`mocap-jax view`: solutions in the Rerun viewer."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from mocap_jax.cli.files import exit_code, output_file, read_input, read_solution_input

if TYPE_CHECKING:
    from mocap_jax.solution import Solution

SUMMARY = "show one or more solutions in the Rerun viewer"
EXAMPLE = "mocap-jax view walk.solution.mcap -o walk.rrd"
NOTE = """Needs the extra `viewer` (pip install 'mocap_jax[viewer]'). Without -o a window opens; a
file that was written is shown by `rerun walk.rrd`. Recordings and solutions (.mcap) open in Rerun
and Foxglove as they are, too."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument(
        "solutions", metavar="SOLUTION", nargs="+", help="solutions of one recording (.mcap)"
    )
    parser.add_argument(
        "-o", "--output", metavar="RRD", help="file to write instead of opening a window"
    )
    parser.add_argument("--recording", metavar="REC", help="recording whose truth to show as well")


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    output = output_file(arguments.output, (".rrd",)) if arguments.output else None
    from mocap_jax.cli.reference import check_relation
    from mocap_jax.view import save_view, show_view

    recording = read_input(arguments.recording) if arguments.recording else None
    solutions: dict[str, Solution] = {}
    for path in arguments.solutions:
        solution = read_solution_input(path)
        if recording is not None:
            check_relation(path, solution, arguments.recording, recording)
        name = Path(path).name.removesuffix(".mcap").removesuffix(".solution")
        solutions[name if name not in solutions else f"{name} {len(solutions) + 1}"] = solution
    if output is None:
        show_view(solutions, recording)
    else:
        save_view(output, solutions, recording)
        print(f"wrote {output}")
    return exit_code(*solutions.values(), *([recording] if recording is not None else []))

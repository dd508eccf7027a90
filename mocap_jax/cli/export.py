"""`mocap-jax export`: a solution's motion in other programs' formats."""

from __future__ import annotations

import argparse

from mocap_jax.cli.files import exit_code, output_file, read_solution_input

SUMMARY = "write a solution's motion as BVH, CSV, NPZ, MOT, STO or TRC, by suffix"
EXAMPLE = "mocap-jax export walk.solution.mcap -o walk.bvh"
SUFFIXES = (".bvh", ".csv", ".npz", ".mot", ".sto", ".trc")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument("solution", metavar="SOLUTION", help="solution (.mcap)")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        required=True,
        help=f"file to write: {', '.join(SUFFIXES)}; *.orientations.sto: segment quaternions",
    )


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    output = output_file(arguments.output, SUFFIXES)
    from mocap_jax.io import export_motion

    solution = read_solution_input(arguments.solution)
    export_motion(output, solution)
    print(f"wrote {output}")
    return exit_code(solution)

"""`mocap-jax export`: a solution's motion in other programs' formats."""

from __future__ import annotations

import argparse

from mocap_jax.cli.exit_codes import SUCCESS
from mocap_jax.cli.files import output_file

SUMMARY = "write a solution's motion as BVH, CSV or NPZ, by suffix"
EXAMPLE = "mocap-jax export walk.solution.mcap -o walk.bvh"
SUFFIXES = (".bvh", ".csv", ".npz")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument("solution", metavar="SOLUTION", help="solution (.mcap)")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        required=True,
        help=f"file to write: {', '.join(SUFFIXES)}",
    )


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    output = output_file(arguments.output, SUFFIXES)
    from mocap_jax.io import export_motion, read_solution

    export_motion(output, read_solution(arguments.solution))
    print(f"wrote {output}")
    return SUCCESS

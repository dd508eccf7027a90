"""`mocap-jax demo`: the main job on the bundled recording."""

from __future__ import annotations

import argparse
import shutil
import sys
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import FAILURE, SUCCESS
from mocap_jax.cli.files import output_folder, read_input
from mocap_jax.cli.results import comparison_table, describe_solution, to_json, write_json

if TYPE_CHECKING:
    from mocap_jax.recording import Recording
    from mocap_jax.solution import Solution

SUMMARY = "run the main job on the bundled recording: filter, whole-sequence solve, errors, report"
EXAMPLE = "mocap-jax demo -o demo"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        default="demo",
        help="folder for the results (default demo)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    folder = output_folder(arguments.output)
    recording = read_input(copy_recording(folder))
    solutions = _estimate(recording, progress=sys.stderr.isatty())
    failed = [s for s in solutions.values() if not s.status.ok]
    if failed:
        print(f"mocap-jax: error: {failed[0].method}: {failed[0].status.value}", file=sys.stderr)
        return FAILURE
    _write_results(folder, recording, solutions)
    return SUCCESS


def copy_recording(folder: Path) -> Path:
    """Copy the bundled recording into a folder as `recording.mcap`."""
    target = folder / "recording.mcap"
    with as_file(files("mocap_jax") / "data" / "demo.mcap") as bundled:
        shutil.copyfile(bundled, target)
    return target


def _estimate(recording: Recording, *, progress: bool) -> dict[str, Solution]:
    from mocap_jax.estimate import EkfOptions, ekf, optimise

    solutions: dict[str, Solution] = {}
    solutions["ekf"] = ekf(recording, progress=progress)
    print(describe_solution(solutions["ekf"]), flush=True)
    smoothed = ekf(recording, options=EkfOptions(smooth=True), progress=progress)
    solutions["ekf_smoothed"] = smoothed
    print(describe_solution(smoothed), flush=True)
    solutions["optimise"] = optimise(recording, initial=smoothed, progress=progress)
    print(describe_solution(solutions["optimise"]), flush=True)
    return solutions


def _write_results(folder: Path, recording: Recording, solutions: dict[str, Solution]) -> None:
    from mocap_jax.io import export_motion, write_solution
    from mocap_jax.metrics import evaluate
    from mocap_jax.report import write_report

    errors = {name: evaluate(solution, recording) for name, solution in solutions.items()}
    write_solution(folder / "ekf.solution.mcap", solutions["ekf"])
    write_solution(folder / "optimised.solution.mcap", solutions["optimise"])
    export_motion(folder / "motion.bvh", solutions["optimise"])
    write_report(folder / "report.html", list(solutions.values()), recording)
    metrics = {name: to_json(solution, errors[name]) for name, solution in solutions.items()}
    write_json(folder / "metrics.json", metrics)
    print(f"\n{comparison_table(errors)}\n\nresults in {folder}:")
    for file in sorted(p for p in folder.iterdir() if p.is_file()):
        print(f"  {file.name}")

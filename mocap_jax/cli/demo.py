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
from mocap_jax.cli.step_lines import StepLines

if TYPE_CHECKING:
    from mocap_jax.metrics import ErrorTable
    from mocap_jax.recording import Recording
    from mocap_jax.solution import Solution

SUMMARY = "run the main job on the bundled recording: filter, whole-sequence solve, errors, report"
EXAMPLE = "mocap-jax demo -o demo"
_STEPS = 6


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
    steps = StepLines(_STEPS)
    with steps.step("recording"):
        recording = read_input(copy_recording(folder))
    solutions = _estimate(recording, steps, progress=sys.stderr.isatty())
    failed = [s for s in solutions.values() if not s.status.ok]
    if failed:
        print(f"mocap-jax: error: {failed[0].method}: {failed[0].status.value}", file=sys.stderr)
        return FAILURE
    with steps.step("errors against the truth"):
        from mocap_jax.metrics import evaluate

        errors = {name: evaluate(solution, recording) for name, solution in solutions.items()}
    with steps.step("files: solutions, motion, report"):
        _write_results(folder, recording, solutions, errors)
    print(f"\n{comparison_table(errors)}\n\nresults in {folder}:")
    for file in sorted(p for p in folder.iterdir() if p.is_file()):
        print(f"  {file.name}")
    return SUCCESS


def copy_recording(folder: Path) -> Path:
    """Copy the bundled recording into a folder as `recording.mcap`."""
    target = folder / "recording.mcap"
    with as_file(files("mocap_jax") / "data" / "demo.mcap") as bundled:
        shutil.copyfile(bundled, target)
    return target


def _estimate(recording: Recording, steps: StepLines, *, progress: bool) -> dict[str, Solution]:
    from mocap_jax.estimate import EkfOptions, ekf, optimise

    solutions: dict[str, Solution] = {}
    smoothing = EkfOptions(smooth=True)
    with steps.step("filter"):
        solutions["ekf"] = ekf(recording, progress=progress)
    _describe(solutions["ekf"])
    with steps.step("smoothed filter"):
        smoothed = ekf(recording, options=smoothing, progress=progress)
    solutions["ekf_smoothed"] = smoothed
    _describe(smoothed)
    with steps.step("whole sequence"):
        solutions["optimise"] = optimise(recording, initial=smoothed, progress=progress)
    _describe(solutions["optimise"])
    return solutions


def _describe(solution: Solution) -> None:
    """Say how it went; the observed joints stand in the table at the end."""
    print(describe_solution(solution, joints=False), flush=True)


def _write_results(
    folder: Path,
    recording: Recording,
    solutions: dict[str, Solution],
    errors: dict[str, ErrorTable],
) -> None:
    from mocap_jax.io import export_motion, write_solution
    from mocap_jax.report import write_report

    write_solution(folder / "ekf.solution.mcap", solutions["ekf"])
    write_solution(folder / "optimised.solution.mcap", solutions["optimise"])
    export_motion(folder / "motion.bvh", solutions["optimise"])
    write_report(folder / "report.html", list(solutions.values()), recording)
    metrics = {name: to_json(solution, errors[name]) for name, solution in solutions.items()}
    write_json(folder / "metrics.json", metrics)

"""What a worker of `batch` does with one recording."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from mocap_jax.cli.estimation import Estimation
from mocap_jax.errors import InputError


def work(asked: Estimation, source: Path, target: Path) -> dict[str, Any]:
    """Estimate one recording, write its solution, and return its results as JSON.

    Args:
        asked: how; `initial` is the folder of solutions to start from.
        source: recording.
        target: solution to write.

    Raises:
        InputError: what is wrong with the recording.
    """
    from mocap_jax.cli.estimate_recording import body_asked_for, estimate_recording
    from mocap_jax.cli.process import prepare_process
    from mocap_jax.cli.results import to_json
    from mocap_jax.io import read_recording, write_solution

    prepare_process()
    warnings: list[str] = []
    recording = read_recording(source)
    solution, errors = estimate_recording(
        recording, source, _from_its_initial(asked, source), body=body_asked_for(asked.body),
        warn=warnings.append,
    )  # fmt: skip
    results = {**to_json(solution, errors), "salvage": list(recording.salvage),
               "warnings": warnings}  # fmt: skip
    if not solution.status.ok:
        return {**results, "failed": solution.status.value}
    write_solution(target, solution)
    return results


def _from_its_initial(asked: Estimation, source: Path) -> Estimation:
    """The same, with the solution of this recording to start from."""
    if asked.initial is None:
        return asked
    file = Path(asked.initial) / f"{source.stem}.solution.mcap"
    if not file.is_file():
        raise InputError(f"{source}: nothing to start from: {file} does not exist")
    return dataclasses.replace(asked, initial=str(file))

"""What the verbs report about a solution: lines for people, JSON for programs."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mocap_jax.cli.files import write_text

if TYPE_CHECKING:
    from mocap_jax.metrics import ErrorTable
    from mocap_jax.recording import Recording
    from mocap_jax.solution import Solution

_HEADLINE = (
    ("orientation_error_mean_deg", "mean_observed", "mean of observed joints [deg]"),
    ("orientation_error_mean_deg", "mean_table1", "neck, shoulder, hip [deg]"),
    ("orientation_error_mean_deg", "mean", "mean of all joints [deg]"),
    ("position_error_mean_cm", "mean", "joint centres [cm]"),
)
_EXPLANATION = (
    "Mean errors against the truth over all scored frames, one column a method: angle between\n"
    "estimated and true rotation of each joint (child in parent; rows are named by the child),\n"
    "and distance of joint centres relative to the pelvis. Observed joints: between segments that\n"
    "carry sensors."
)
_TABLE1_EXPLANATION = (
    "Neck, (right) shoulder, (left) hip: the three joints of table 1 in Vlasic et al. 2007,\n"
    "relative to the root segment (mean_table1 in JSON)."
)


def errors_against_truth(solution: Solution, recording: Recording) -> ErrorTable | None:
    """Errors of a solution, where the recording holds its truth and reaches what is scored."""
    from mocap_jax.metrics import evaluate

    if recording.truth is None or ends_before_scores(solution):
        return None
    return evaluate(solution, recording)


def ends_before_scores(solution: Solution) -> bool:
    """Whether a (cut) recording ends in its rest hold or blend, which are not scored."""
    return float(solution.trajectory.time[-1]) < solution.setup.score_from


def to_json(solution: Solution, errors: ErrorTable | None = None) -> dict[str, Any]:
    """Machine-readable results of a solution; non-finite numbers become null."""
    content: dict[str, Any] = {
        "status": solution.status.value,
        "method": solution.method,
        "frames": len(solution.trajectory.time),
        "seconds_solve": solution.seconds_solve,
        "seconds_compile": solution.seconds_compile,
        "iterations": solution.iterations,
        "cost": list(solution.cost),
        "observed": list(solution.observed),
        "remarks": list(solution.remarks),
    }
    if errors is not None:
        content["errors"] = errors.errors
    return _finite(content)


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write results as JSON, whole or not at all."""
    write_text(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def describe_solution(solution: Solution, *, joints: bool = True) -> str:
    """Status, effort, remarks and observed joints of a solution, for people.

    Args:
        solution: to describe.
        joints: list the observed joints.
    """
    lines = [
        f"{solution.method}: {solution.status.value}",
        f"  {len(solution.trajectory.time)} frames, {_effort(solution)}"
        f"{solution.seconds_solve:.1f} s solving, {solution.seconds_compile:.1f} s compiling",
    ]
    lines += [f"  {remark}" for remark in solution.remarks]
    if joints:
        names = ", ".join(solution.observed) or "none"
        lines.append(f"  observed joints ({len(solution.observed)}): {names}")
    return "\n".join(lines)


def _effort(solution: Solution) -> str:
    """Steps an optimiser tried, with the limit, which holds for each round."""
    if not solution.iterations:
        return ""
    solver = solution.options.get("solver")
    limit = solver.get("max_iterations") if isinstance(solver, dict) else None
    bound = f" (limit {limit} a round)" if limit else ""
    return f"{solution.iterations} steps tried in all rounds{bound}, "


def comparison_table(errors: Mapping[str, ErrorTable]) -> str:
    """One column a method: mean error of each observed joint, then means over all kinds of joints.

    Args:
        errors: by method.
    """
    tables = {method: table.errors for method, table in errors.items()}
    observed = dict.fromkeys(joint for table in errors.values() for joint in table.observed)
    joints = [(_HEADLINE[0][0], joint, joint) for joint in observed]
    means = [c for c in _HEADLINE if any(c[1] in t.get(c[0], {}) for t in tables.values())]
    first = f"{len(joints)} observed joints [deg]" if joints else "means"
    width = max(len(title) for _, _, title in [*joints, *means, ("", "", first)])
    header = f"{first:<{width}}" + "".join(f"  {_column(name)}" for name in tables)
    lines = [header, "-" * len(header), *(_comparison_row(row, width, tables) for row in joints)]
    if joints:
        lines.append("-" * len(header))
    lines += [_comparison_row(row, width, tables) for row in means]
    lines += ["", _EXPLANATION]
    if any(key == "mean_table1" for _, key, _ in means):
        lines.append(_TABLE1_EXPLANATION)
    return "\n".join(lines)


def _column(text: str) -> str:
    return f"{text:>12}"


def _comparison_row(
    row: tuple[str, str, str], width: int, tables: Mapping[str, Mapping[str, Mapping[str, float]]]
) -> str:
    metric, key, title = row
    cells = (
        f"  {table.get(metric, {}).get(key, math.nan):>{len(_column(name))}.3f}"
        for name, table in tables.items()
    )
    return f"{title:<{width}}{''.join(cells)}"


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value

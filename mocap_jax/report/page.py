"""`write_report`: solutions of one recording as one self-contained HTML page."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import jinja2
import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.initialise import SensorCheck, check_sensors
from mocap_jax.io.atomic import atomic_file
from mocap_jax.metrics import ErrorTable, evaluate
from mocap_jax.recording import Recording
from mocap_jax.report import tables
from mocap_jax.report.constant_tables import constant_tables, constants_verdict
from mocap_jax.report.pictures import all_pictures
from mocap_jax.report.player import player_data
from mocap_jax.report.statistic_streams import statistic_sources
from mocap_jax.report.style import colours
from mocap_jax.report.summary import summary_rows
from mocap_jax.report.verdicts import (
    accuracy_verdict,
    consistency_table,
    coverages,
    uncertainty_verdict,
)
from mocap_jax.solution import Solution, stated_determination

_METHOD_NAMES = {
    "ekf": "Kalman filter",
    "ekf_smoothed": "Kalman smoother",
    "ukf": "Unscented Kalman filter",
    "ukf_smoothed": "Unscented Kalman smoother",
    "optimise": "Optimiser",
    "orientation": "Orientations only",
}


def write_report(
    path: str | os.PathLike[str],
    solutions: Solution | Sequence[Solution] | Mapping[str, Solution],
    recording: Recording | None = None,
) -> None:
    """Write one HTML file with everything in it: figures, tables, remarks.

    What a solution or the recording does not hold (truth, covariance, ranges, ...) is left out.

    Args:
        path: file to write; it appears whole or not at all.
        solutions: one solution, several, or several by the name to show.
        recording: what they were estimated from; adds its facts, and errors where it has truth.

    Raises:
        InputError: no solution, or the file cannot be written.
    """
    named = _named(solutions)
    if not named:
        raise InputError("write_report: no solution given (give one, a list or a dictionary)")
    text = render(named, recording)
    with atomic_file(path) as stream:
        stream.write(text.encode("utf-8"))


def _named(
    solutions: Solution | Sequence[Solution] | Mapping[str, Solution],
) -> dict[str, Solution]:
    if isinstance(solutions, Solution):
        solutions = [solutions]
    if isinstance(solutions, Mapping):
        return {_METHOD_NAMES.get(name, name): s for name, s in solutions.items()}
    named: dict[str, Solution] = {}
    for solution in solutions:
        name = _METHOD_NAMES.get(solution.method, solution.method)
        same = sum(1 for n in named if n == name or n.startswith(f"{name} ("))
        named[f"{name} ({same + 1})" if same else name] = solution
    return named


def render(solutions: dict[str, Solution], recording: Recording | None) -> str:
    """The page as text."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    usable = {n: s for n, s in solutions.items() if _drawable(s)}
    errors, palette = _errors(usable, recording), colours(list(solutions))
    constants = constant_tables(solutions, recording)
    covered = coverages(usable, recording) if errors else {}
    accuracy, uncertainty = accuracy_verdict(errors, usable), uncertainty_verdict(covered)
    return environment.get_template("page.html.j2").render(
        title=_title(solutions, recording),
        subtitle=_subtitle(solutions, recording),
        summary=summary_rows(solutions, recording, accuracy, uncertainty),
        facts=_facts(solutions, recording, errors),
        cards=[_card(n, s, c) for (n, s), c in zip(
            solutions.items(), palette.values(), strict=True)],
        check=_check(recording),
        salvage=recording.salvage if recording is not None else (),
        colours=palette,
        headline=tables.headline_table(errors) if errors else None,
        root_relative=tables.root_table(errors) if errors else None,
        joints=tables.joint_table(errors) if errors else None,
        angles=tables.angle_table(errors) if errors else None,
        accuracy=accuracy,
        uncertainty=uncertainty,
        consistency=consistency_table(covered),
        scored=_scored(errors),
        observed=next((", ".join(e.observed) for e in errors.values()), ""),
        residuals=tables.residual_table(statistic_sources(solutions)),
        constant_tables=constants,
        constants_verdict=constants_verdict(constants),
        constants_determined={n: t for n, s in solutions.items() if (t := stated_determination(s))},
        player=player_data(usable, palette, recording if errors else None) if usable else None,
        **all_pictures(usable, recording, palette, scored=bool(errors)),
    )  # fmt: skip


def _drawable(solution: Solution) -> bool:
    q = np.asarray(solution.trajectory.q)
    return len(q) > 1 and bool(np.isfinite(q).all())


def _errors(solutions: dict[str, Solution], recording: Recording | None) -> dict[str, ErrorTable]:
    """Errors by method; none without truth or where nothing can be compared."""
    if recording is None or recording.truth is None:
        return {}
    out = {}
    for name, solution in solutions.items():
        try:
            out[name] = evaluate(solution, recording)
        except InputError:
            return {}
    return out


def _check(recording: Recording | None) -> SensorCheck | None:
    """The check of the sensors; None where there is nothing to check them with."""
    if recording is None or not recording.inertial:
        return None
    try:
        return check_sensors(recording)
    except InputError:
        return None


def _title(solutions: dict[str, Solution], recording: Recording | None) -> str:
    for setup in [s.setup for s in solutions.values()]:
        motion = setup.provenance.get("motion")
        if motion:
            return str(motion)
    return (recording.subject if recording is not None else "") or "Reconstructed motion"


def _subtitle(solutions: dict[str, Solution], recording: Recording | None) -> str:
    setup = next(iter(solutions.values())).setup
    subject = recording.subject if recording is not None else ""
    parts = [subject] if subject and subject != _title(solutions, recording) else []
    if profile := setup.provenance.get("profile"):
        kind = "simulated, " if setup.provenance.get("simulated") else ""
        parts.append(f"{kind}{profile} profile")
    if recording is not None and recording.start_utc_ns:
        start = datetime.fromtimestamp(recording.start_utc_ns / 1e9, UTC)
        parts.append(f"{start:%Y-%m-%d %H:%M} UTC")
    return " \u00b7 ".join(parts)


def _facts(
    solutions: dict[str, Solution], recording: Recording | None, errors: dict[str, ErrorTable]
) -> list[tuple[str, str]]:
    first = next(iter(solutions.values()))
    time = np.asarray(first.trajectory.time)
    facts = [("frames", f"{len(time)}")]
    if len(time) > 1:
        facts.insert(0, ("duration", f"{time[-1] - time[0]:.1f} s"))
        facts.append(("frame rate", f"{1 / np.median(np.diff(time)):.0f} Hz"))
    facts.append(("degrees of freedom", f"{first.body.nv}"))
    setup = recording.setup if recording is not None else first.setup
    if setup.sensors:
        facts.append(("sensor boards", f"{len(setup.sensors)}"))
    if setup.sources:
        facts.append(("ultrasonic sources", f"{len(setup.sources)}"))
    observed = next((e.observed for e in errors.values()), first.observed)
    if observed:
        facts.append(("observed joints", f"{len(observed)}"))
    return facts


def _card(name: str, solution: Solution, colour: str) -> dict[str, object]:
    facts = []
    if solution.iterations:
        facts.append(("steps tried, all rounds", f"{solution.iterations}"))
    if solution.cost:
        facts.append(("final cost", f"{solution.cost[-1]:.5g}"))
    if solution.seconds_solve:
        facts.append(("solve", f"{solution.seconds_solve:.1f} s"))
    if solution.seconds_compile:
        facts.append(("compile", f"{solution.seconds_compile:.1f} s"))
    return {
        "name": name,
        "colour": colour,
        "ok": solution.status.ok,
        "status": solution.status.value,
        "facts": facts,
        "remarks": [x for x in solution.remarks if x != stated_determination(solution)],
        "options": [(k, str(v)) for k, v in sorted(solution.options.items())],
    }


def _scored(errors: dict[str, ErrorTable]) -> str:
    if not errors:
        return ""
    first = next(iter(errors.values()))
    return (
        f"Scored over {first.frames} frames, {first.interval[0]:.2f} s to "
        f"{first.interval[1]:.2f} s, without the rest hold and the blend."
    )

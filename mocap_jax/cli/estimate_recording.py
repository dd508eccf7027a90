"""One recording estimated as asked for: what `reconstruct` and `batch` do with it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from mocap_jax.cli.estimation import Estimation
from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.cli.human_text import human_of, is_human, read_human
from mocap_jax.cli.methods import solve
from mocap_jax.cli.results import errors_against_truth
from mocap_jax.cli.setup_choice import corrected
from mocap_jax.cli.skeleton import is_skeleton, read_body
from mocap_jax.cli.stretch import cut_as_asked, cut_remarks
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.body import Body
    from mocap_jax.metrics import ErrorTable
    from mocap_jax.recording import Recording
    from mocap_jax.solution import Solution


def body_asked_for(text: str | None) -> Body | None:
    """The body of `--body`; None for the recording's own."""
    if is_human(text):
        where = f"--body {text} (height, mass, sex or the length of a segment)"
        return human_of(read_human(text or ""), where)
    return read_body(text) if text else None


def estimate_recording(
    whole: Recording,
    source: Path,
    asked: Estimation,
    *,
    warn: Callable[[str], None],
    body: Body | None = None,
    progress: bool = False,
) -> tuple[Solution, ErrorTable | None]:
    """Check a recording and estimate its motion.

    Args:
        whole: the recording, not yet corrected by the set-up file asked for, nor cut.
        source: its file, for messages.
        asked: how.
        warn: told each sensor that looks wrong, and names in the set-up file that nobody bears,
            before the estimate.
        body: `body_asked_for(asked.body)`.
        progress: show progress bars on stderr.

    Returns:
        The solution with all remarks, and its errors where the recording holds its truth.

    Raises:
        InputError: what is wrong with the recording or the body.
        UsageError: what is asked for does not go with the recording.
    """
    from mocap_jax.estimate.inputs import measures_root
    from mocap_jax.io import validate_recording

    whole = corrected(asked.setup, whole, warn)
    recording = cut_as_asked(asked, whole, str(source))
    if body is not None and (is_human(asked.body) or is_skeleton(asked.body)):
        recording, body = _dressed(recording, body, source, asked.body or "")
    validate_recording(recording, body, name=str(source), body_name=asked.body or "body.xml")
    if asked.root == "given" and not measures_root(recording):
        raise UsageError(f"--root given: {source} has no root pose (topic /root); valid: free")
    suspicions = _suspicions(recording, body)
    for sentence in suspicions:
        warn(sentence)
    preset = asked.chosen
    solution = solve(
        recording,
        body,
        method=asked.method or preset.method,
        kinds=asked.sensors or preset.kinds,
        root=asked.root or preset.root,  # type: ignore[arg-type]
        process=preset.process,
        smooth=asked.smooth,
        sparse=preset.sparse,
        contacts=asked.contacts,
        gravity=asked.gravity,
        initial=_initial(asked.initial),
        progress=progress,
    )
    told = (*cut_remarks(whole, recording), *suspicions, *solution.remarks, *recording.salvage)
    solution = dataclasses.replace(solution, remarks=tuple(dict.fromkeys(told)))
    return solution, errors_against_truth(solution, recording) if solution.status.ok else None


def _initial(path: str | None) -> Solution | None:
    from mocap_jax.io import read_solution

    return None if path is None else read_solution(path)


def _dressed(recording: Recording, body: Body, source: Path, text: str) -> tuple[Recording, Body]:
    """The recording on a body without sites of its own, and that body with its sensors."""
    from mocap_jax.conversion import wear

    try:
        return wear(recording, body)
    except InputError as error:
        raise InputError(f"{source}: --body {text}: {error}") from error


def _suspicions(recording: Recording, body: Body | None) -> tuple[str, ...]:
    """Sensors that look swapped, turned, cut short or of wrong unit, and such a root."""
    from mocap_jax.estimate.inputs import mounting_remarks
    from mocap_jax.initialise import check_sensors
    from mocap_jax.recording import doubtful_root, ragged_ends, unlisted_boards

    return (
        *mounting_remarks(recording), *check_sensors(recording, body).sentences,
        *ragged_ends(recording), *unlisted_boards(recording), *doubtful_root(recording),
    )  # fmt: skip

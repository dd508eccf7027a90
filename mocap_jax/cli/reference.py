"""The reference of an evaluation: a recording that holds its truth, or another solution."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.recording import Recording
    from mocap_jax.solution import Solution


def read_reference(path: str | os.PathLike[str]) -> Recording | Solution:
    """Read a reference; raises `InputError` for a recording without truth."""
    from mocap_jax.cli.files import read_input, read_solution_input

    try:
        return read_solution_input(path)
    except InputError as not_a_solution:
        try:
            recording = read_input(path)
        except InputError:
            raise not_a_solution from None
    if recording.truth is None:
        raise InputError(
            f"{path}: a recording without truth (topics /truth/*) cannot be a reference; valid: a "
            "simulated recording or a solution"
        )
    return recording


def check_relation(
    path: str, solution: Solution, reference_path: str, reference: Recording | Solution
) -> None:
    """Refuse a reference of another recording; say on stderr where it only seems to be one.

    Raises:
        InputError: errors against this reference would mean nothing.
    """
    from mocap_jax.metrics.relation import contradictions, signs_of_another_recording

    if found := contradictions(solution, reference):
        raise InputError(
            f"{path} was not made from the recording of {reference_path}: {'; '.join(found)} "
            "(name the recording it was made from, or a solution of that one)"
        )
    signs = signs_of_another_recording(solution, reference)
    if signs:
        print(
            f"mocap-jax: warning: {path} and {reference_path} do not seem to be of the same "
            f"recording: {'; '.join(signs)}",
            file=sys.stderr,
        )

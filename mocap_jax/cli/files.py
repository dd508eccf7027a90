"""Input and output paths of the verbs, checked before any long work."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import SALVAGED, SUCCESS, UsageError
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.recording import Recording
    from mocap_jax.solution import Solution


# Arguments that name files, by what becomes of them.
_INPUTS = (
    "recording", "recordings", "table", "setup", "solution", "solutions", "reference", "motion",
    "motions", "file", "body", "skeleton", "sensors", "sources", "mapping", "initial", "inputs",
    "pose",
)  # fmt: skip
_OUTPUTS = ("output", "json", "plot")


def output_file(path: str | os.PathLike[str], suffixes: Iterable[str] = ()) -> Path:
    """Check that a file can be written at a path.

    Args:
        path: the file to write; its folder must exist.
        suffixes: valid endings such as ".csv"; none means any.

    Raises:
        InputError: the folder does not exist or cannot be written, or the path is a folder.
        UsageError: the suffix is not among the valid ones.
    """
    file, valid = Path(path), tuple(suffixes)
    if valid and file.suffix.lower() not in valid:
        raise UsageError(
            f"--output {file}: unknown suffix '{file.suffix}'; valid: {', '.join(valid)}"
        )
    folder = file.parent
    if not folder.is_dir():
        raise InputError(f"{file}: cannot be written, '{folder}' is not an existing folder")
    if file.is_dir():
        raise InputError(f"{file}: is a folder; name the file to write")
    if file.exists() and not file.is_file():  # a device or a pipe would be replaced by a file
        raise InputError(f"{file}: is not a regular file; name another")
    if not os.access(folder, os.W_OK):
        raise InputError(f"{file}: cannot be written, no permission to write in '{folder}'")
    return file


def keep_inputs(arguments: argparse.Namespace) -> None:
    """Refuse to write over a file that the same call reads, or twice to one file.

    Raises:
        UsageError: naming the file and both arguments.
    """
    seen: dict[Path, str] = {}
    for name in (*_INPUTS, *_OUTPUTS):
        given = getattr(arguments, name, None)
        for path in given if isinstance(given, list) else [given]:
            if not isinstance(path, str) or not Path(path).suffix:
                continue
            place = Path(path).resolve()
            if name in _OUTPUTS and place in seen:
                raise UsageError(
                    f"{path}: --{name} would overwrite {seen[place]}; give it a name of its own"
                )
            read = "a file that this call reads"
            seen.setdefault(place, read if name in _INPUTS else f"what --{name} writes")


def possible_folder(path: str | os.PathLike[str]) -> Path:
    """Check that a folder can be made or written in, and make none: long work may be refused yet.

    Raises:
        InputError: what exists of the path is no folder, or must not be written in.
    """
    folder = Path(path)
    there = next((p for p in (folder, *folder.absolute().parents) if os.path.exists(p)), folder)
    if not there.is_dir():
        raise InputError(f"{folder}: cannot be made a folder: '{there}' is none")
    if not os.access(there, os.W_OK):
        raise InputError(f"{folder}: no permission to write in '{there}'")
    return folder


def output_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder for several files; raises `InputError` where that is impossible."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made a folder: {error.strerror}") from error
    if not os.access(folder, os.W_OK):
        raise InputError(f"{folder}: no permission to write there")
    return folder


def write_text(path: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def read_input(path: str | os.PathLike[str]) -> Recording:
    """Read a recording and say on stderr what was lost, if it was damaged."""
    from mocap_jax.io import read_recording

    _refuse_motion(path, "recording")
    recording = read_recording(path)
    _warn(path, losses(recording))
    return recording


def read_solution_input(path: str | os.PathLike[str]) -> Solution:
    """Read a solution and say on stderr what was lost, if its file was damaged."""
    from mocap_jax.io import read_solution

    _refuse_motion(path, "solution")
    solution = read_solution(path)
    _warn(path, losses(solution))
    return solution


def _refuse_motion(path: str | os.PathLike[str], wanted: str) -> None:
    """Say of a motion file what to do with it."""
    from mocap_jax.motion import MOTION_SUFFIXES

    file = Path(path)
    if file.is_file() and file.suffix.lower() in MOTION_SUFFIXES:
        raise InputError(
            f"{path}: this is a motion file, not a {wanted}; make a recording of it first: "
            f"mocap-jax simulate {path} -o {file.with_suffix('.mcap').name}"
        )


def losses(source: Recording | Solution) -> tuple[str, ...]:
    """What was lost when a file was read, one sentence each."""
    if hasattr(source, "salvage"):
        return source.salvage
    return tuple(remark for remark in source.remarks if remark.startswith("Salvaged:"))


def exit_code(*sources: Recording | Solution) -> int:
    """Exit code of a verb that made a result from these files."""
    return SALVAGED if any(losses(source) for source in sources) else SUCCESS


def _warn(path: str | os.PathLike[str], lost: tuple[str, ...]) -> None:
    if lost:
        print(f"mocap-jax: warning: {path}: damaged; {' '.join(lost)}", file=sys.stderr)

"""`Job`: one recording of a batch, where its results go, and whether they are there already."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mocap_jax.errors import InputError

# Raised when results of the same inputs would differ for a reason that the version does not tell.
_FORMAT = 1


@dataclass(frozen=True)
class Job:
    """One recording."""

    source: Path
    solution: Path
    """File to write."""
    record: Path
    """JSON with the results; written last, so that its presence says that the job was done."""
    fingerprint: str
    """Of all contents and options that the results depend on."""

    @property
    def finished(self) -> dict[str, Any] | None:
        """The record of an earlier run on the same inputs with the same options; None without."""
        try:
            record = json.loads(self.record.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        same = isinstance(record, dict) and record.get("fingerprint") == self.fingerprint
        return record if same and not record.get("failed") and self.solution.is_file() else None


def jobs_of(
    inputs: Iterable[str | Path],
    folder: Path,
    options: Mapping[str, Any],
    *,
    more: Mapping[str, Iterable[Path]] | None = None,
) -> list[Job]:
    """A job for each recording, in the order given.

    Args:
        inputs: recordings, and folders of them (all `*.mcap` in them that are no solutions).
        folder: where results go.
        options: all that was asked for, and the software's version; as JSON part of the
            fingerprint.
        more: by stem of the recording (or "" for all) further files the results depend on.

    Raises:
        InputError: nothing to do, a missing file, or two recordings of one name.
    """
    sources = _recordings(inputs)
    stems: dict[str, Path] = {}
    for source in sources:
        if (other := stems.setdefault(source.stem, source)) is not source:
            raise InputError(
                f"{source}: results would be called as those of {other}; give each recording a "
                "name of its own"
            )
    further = more or {}
    jobs = []
    for source in sources:
        files = [source, *further.get("", ()), *further.get(source.stem, ())]
        jobs.append(
            Job(
                source.absolute(),
                (folder / f"{source.stem}.solution.mcap").absolute(),
                (folder / f"{source.stem}.json").absolute(),
                _fingerprint(files, options),
            )
        )
    return jobs


def _recordings(inputs: Iterable[str | Path]) -> list[Path]:
    found: dict[Path, None] = {}
    for given in map(Path, inputs):
        if given.is_dir():
            inside = [p for p in sorted(given.glob("*.mcap")) if not is_solution(p)]
            if not inside:
                raise InputError(f"{given}: no recordings (*.mcap) in this folder")
            found |= dict.fromkeys(inside)
        elif given.is_file():
            found[given] = None
        else:
            raise InputError(f"{given}: no such file or folder")
    return list(found)


def is_solution(path: Path) -> bool:
    """Whether a file is named as solutions are."""
    return path.name.endswith(".solution.mcap")


def _fingerprint(files: Iterable[Path], options: Mapping[str, Any]) -> str:
    digest = hashlib.sha256(json.dumps([_FORMAT, dict(options)], sort_keys=True).encode())
    for file in files:
        with file.open("rb") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()

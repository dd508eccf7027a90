"""Scores of estimates as files, so that a run that was cut off goes on from where it was."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar


class Cell(Protocol):
    """What identifies one estimate: a frozen dataclass."""

    @property
    def file(self) -> str:
        """Where its scores are kept, in the folder of a store."""


C = TypeVar("C", bound=Cell)


class Store(Generic[C]):
    """A folder of cells; each file appears whole or not at all."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def has(self, cell: C) -> bool:
        """Whether the present code has made it already."""
        return (self.folder / cell.file).is_file()

    def get(self, cell: C, *, any_version: bool = False) -> dict[str, Any] | None:
        """Scores of a cell, if it was computed; of the newest other version, if so wanted.

        The version of the code stands after the last hyphen of a file's name.
        """
        file = self.folder / cell.file
        if any_version and not file.is_file():
            others = file.parent.glob(f"{file.name.rsplit('-', 1)[0]}-*.json")
            file = max(others, key=os.path.getmtime, default=file)
        return json.loads(file.read_text(encoding="utf-8")) if file.is_file() else None

    def read(self, cells: Iterable[C], *, any_version: bool = False) -> Iterator[tuple[C, dict]]:
        """Cells that are there, with their scores."""
        for cell in cells:
            scores = self.get(cell, any_version=any_version)
            if scores is not None:
                yield cell, scores

    def write(self, cell: C, scores: dict[str, Any]) -> None:
        """Keep the scores of a cell."""
        target = self.folder / cell.file
        target.parent.mkdir(parents=True, exist_ok=True)
        part = target.with_suffix(f".{os.getpid()}.part")
        part.write_text(json.dumps({"cell": asdict(cell), **scores}) + "\n", encoding="utf-8")
        os.replace(part, target)

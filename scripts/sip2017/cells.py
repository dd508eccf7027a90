"""One cell is one estimate: clip, seed and row. Cells are kept as files."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from vlasic2007.cells import code_version


@dataclass(frozen=True)
class Cell:
    """What identifies one estimate."""

    clip: str
    seed: int
    row: str
    sensors: str
    profile: str
    rate_hz: float
    cut: float | None
    """Only the first seconds of the clip were used; None for all."""

    @property
    def label(self) -> str:
        """The clip as tables call it."""
        return Path(self.clip).stem


class Store:
    """A folder of cells; each file appears whole or not at all."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def file(self, cell: Cell) -> Path:
        """Where a cell made by the present code is kept."""
        length = "whole" if cell.cut is None else f"{cell.cut:g}s"
        name = f"{cell.row}-{cell.seed}-{cell.rate_hz:g}Hz-{code_version('optimise')}.json"
        return self.folder / f"{cell.label}-{length}" / f"{cell.sensors}-{cell.profile}" / name

    def has(self, cell: Cell) -> bool:
        """Whether the present code has made it already."""
        return self.file(cell).is_file()

    def write(self, cell: Cell, scores: dict) -> None:
        """Keep the scores of a cell."""
        target = self.file(cell)
        target.parent.mkdir(parents=True, exist_ok=True)
        part = target.with_suffix(f".{os.getpid()}.part")
        part.write_text(json.dumps({"cell": asdict(cell), **scores}) + "\n", encoding="utf-8")
        os.replace(part, target)

    def read(self, cells: list[Cell]) -> Iterator[tuple[Cell, dict]]:
        """Cells that are there."""
        for cell in cells:
            if self.has(cell):
                yield cell, json.loads(self.file(cell).read_text(encoding="utf-8"))

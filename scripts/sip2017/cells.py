"""One cell is one estimate: clip, seed and row. Cells are kept as files."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path

from vlasic2007.cells import code_version

_HERE = Path(__file__).parent
# Besides the package: what makes recordings, bodies and scores of the cells.
_SCRIPTS = (
    *(_HERE / f"{name}.py" for name in ("bodies", "compute", "rows")), _HERE.parent / "clips.py",
)  # fmt: skip


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

    @property
    def draw(self) -> int:
        """Seed of the errors: every clip has its own."""
        return zlib.crc32(f"{self.label} {self.seed}".encode())

    @property
    def file(self) -> str:
        """Where a cell made by the present code is kept, see `Store`."""
        length = "whole" if self.cut is None else f"{self.cut:g}s"
        name = (
            f"{self.row}-{self.seed}-{self.rate_hz:g}Hz-{code_version('optimise', _SCRIPTS)}.json"
        )
        return f"{self.label}-{length}/{self.sensors}-{self.profile}/{name}"

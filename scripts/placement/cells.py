"""One cell is one real reconstruction: motion, suit, profile, seed. Cells are kept as files."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

Device = tuple[str, str, tuple[float, ...], tuple[float, ...]]
"""Name, segment, position [m] and orientation (wxyz) on it."""


@dataclass(frozen=True)
class Clip:
    """A stretch of a motion."""

    motion: str
    """A built-in motion, or the name of a CMU clip."""
    start: float
    seconds: float

    @property
    def label(self) -> str:
        """How tables call it."""
        return f"{Path(self.motion).stem} {self.start:g}-{self.start + self.seconds:g} s"


@dataclass(frozen=True)
class Cell:
    """What identifies one reconstruction."""

    clip: Clip
    boards: tuple[Device, ...]
    sources: tuple[Device, ...]
    profile: str
    seed: int
    root: str
    rate_hz: float | None
    """Frame grid of the optimiser; None for its default."""

    @property
    def key(self) -> str:
        """Short hash of it."""
        text = json.dumps(asdict(self), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


class Store:
    """A folder of cells; each file appears whole or not at all."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def read(self, cell: Cell) -> dict[str, Any] | None:
        """Scores of a cell, if it was computed."""
        file = self.folder / f"{cell.key}.json"
        return json.loads(file.read_text(encoding="utf-8")) if file.is_file() else None

    def write(self, cell: Cell, scores: dict[str, Any]) -> None:
        """Keep the scores of a cell."""
        self.folder.mkdir(parents=True, exist_ok=True)
        file = self.folder / f"{cell.key}.json"
        part = file.with_suffix(f".{os.getpid()}.part")
        part.write_text(json.dumps({"cell": asdict(cell), **scores}) + "\n", encoding="utf-8")
        os.replace(part, file)


def devices(mountings: Any) -> tuple[Device, ...]:
    """Devices of a suit as a cell holds them."""
    return tuple((m.name, m.segment, tuple(m.position), tuple(m.orientation)) for m in mountings)


def load(clip: Clip, body: Any) -> Any:
    """The stretch of a motion on a body."""
    import numpy as np
    from clips import load_clip

    import mocap_jax as mj

    if clip.motion in mj.BUILTIN_MOTIONS:
        motion = mj.builtin_motion(clip.motion, body)
    else:
        motion = mj.retarget(load_clip(clip.motion), body)
    path = motion.trajectory
    time = np.asarray(path.time)
    kept = (time >= time[0] + clip.start) & (time <= time[0] + clip.start + clip.seconds)
    shorter = dataclasses.replace(
        path, time=time[kept] - time[kept][0], q=np.asarray(path.q)[kept], v=None
    )
    return dataclasses.replace(motion, name=clip.label, trajectory=shorter)


def compute(cell: Cell) -> dict[str, Any]:
    """Simulate and reconstruct."""
    import mocap_jax as mj
    from mocap_jax.simulation import Mounting, Suit

    body = mj.human()
    suit = Suit(*(tuple(Mounting(*d) for d in group) for group in (cell.boards, cell.sources)))
    recording = mj.simulate(load(cell.clip, body), profile=cell.profile, seed=cell.seed, suit=suit)
    options = mj.OptimiseOptions(
        kinds="AGD" if cell.sources else "AG", root=cell.root, rate_hz=cell.rate_hz,
        covariance=False,
    )  # fmt: skip
    solution = mj.optimise(recording, options=options)
    errors = mj.evaluate(solution, recording)
    return {
        "status": solution.status.name,
        "seconds": solution.seconds_solve,
        "position_cm": errors["position_error_mean_cm"],
        "orientation_deg": errors["orientation_error_mean_deg"],
    }


def ensure(cell: Cell, store: Store) -> dict[str, Any]:
    """Scores of a cell, computed if they are not there."""
    found = store.read(cell)
    if found is None:
        store.write(cell, compute(cell))
        found = store.read(cell)
    assert found is not None
    return found

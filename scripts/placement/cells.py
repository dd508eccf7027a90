"""One cell is one real reconstruction: motion, suit, profile, seed. Cells are kept as files."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from estimate_store import Store

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
    def file(self) -> str:
        """Where it is kept, see `Store`: a short hash of it."""
        text = json.dumps(asdict(self), sort_keys=True)
        return f"{hashlib.sha256(text.encode()).hexdigest()[:16]}.json"


def devices(mountings: Any) -> tuple[Device, ...]:
    """Devices of a suit as a cell holds them."""
    return tuple((m.name, m.segment, tuple(m.position), tuple(m.orientation)) for m in mountings)


def load(clip: Clip, body: Any) -> Any:
    """The stretch of a motion on a body."""
    from clips import load_clip

    import mocap_jax as mj

    if clip.motion in mj.BUILTIN_MOTIONS:
        motion = mj.builtin_motion(clip.motion, body)
    else:
        motion = mj.retarget(load_clip(clip.motion), body)
    stretch = mj.cut_motion(motion, clip.start, clip.start + clip.seconds)
    path = dataclasses.replace(stretch.trajectory, v=None)
    return dataclasses.replace(stretch, name=clip.label, trajectory=path)


def compute(cell: Cell) -> dict[str, Any]:
    """Simulate and reconstruct."""
    import mocap_jax as mj
    from mocap_jax.simulation import Mounting, Suit

    body = mj.human()
    suit = Suit(*(tuple(Mounting(*d) for d in group) for group in (cell.boards, cell.sources)))
    recording = mj.simulate(load(cell.clip, body), profile=cell.profile, seed=cell.seed, suit=suit)
    # Few boards are solved as people would solve them: with a pose prior and boards on skin.
    usual = mj.OptimiseOptions() if cell.sources else mj.sparse_options(_prior(cell.clip))
    options = dataclasses.replace(
        usual, kinds="AGD" if cell.sources else "AG", root=cell.root, rate_hz=cell.rate_hz,
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


def _prior(clip: Clip) -> Any:
    """A pose prior that never saw who moves."""
    from clips import subject_of
    from sip2017.compute import prior_without

    import mocap_jax as mj

    if clip.motion in mj.BUILTIN_MOTIONS:
        return mj.default_pose_prior()
    return prior_without(subject_of(clip.motion))


_last: list[tuple[Device, ...]] = []


def _only_programs_of(boards: tuple[Device, ...]) -> None:
    """Drop the programs of the last suit if this is another: dozens do not fit in a process."""
    from mocap_jax.stored_programs import forget_programs

    if _last and _last[0] != boards:
        forget_programs()
    _last[:] = [boards]


def ensure(cell: Cell, store: Store[Cell]) -> dict[str, Any]:
    """Scores of a cell, computed if they are not there."""
    if not store.has(cell):
        _only_programs_of(cell.boards)
        store.write(cell, compute(cell))
    found = store.get(cell)
    assert found is not None
    return found

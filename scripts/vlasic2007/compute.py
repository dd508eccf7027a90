"""Compute cells: one group (motion, profile, seed) at a time, so that it is simulated once.

Groups of one worker run in one process, where they share compiled programs.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from typing import Any

from estimate_store import Store
from group_pool import Report, run_groups

from vlasic2007.cells import Cell

Group = list[Cell]


def groups(cells: list[Cell]) -> list[Group]:
    """Cells by recording; within one, by sensors: an optimiser starts from its smoothed filter."""
    found: dict[tuple, Group] = {}
    for cell in cells:
        key = (cell.motion, cell.profile, cell.chain, cell.seed)
        found.setdefault(key, []).append(cell)
    return list(found.values())


def run_group(group: Group, store: Store, report: Report) -> None:
    """Compute the cells of one recording and keep each as soon as it is done."""
    from clips import load_clip

    import mocap_jax as mj
    from vlasic2007.chain import recorded
    from vlasic2007.scores import scores_of

    first = group[0]
    try:
        motion = load_clip(first.motion, first.cut)
        recording = recorded(motion, first)
    except mj.MocapError as error:
        for cell in group:
            report(cell, str(error))
        return
    for cell, solution in _estimates(group, recording):
        try:
            store.write(cell, scores_of(solution(), recording))
            report(cell, "")
        except Exception as error:  # One estimate that fails must not cost the night's others.
            traceback.print_exc()
            report(cell, str(error) or type(error).__name__)


def _estimates(group: Group, recording: Any) -> Iterator[tuple[Cell, Callable[[], Any]]]:
    """A function that makes the estimate of each cell; smoothed ones serve as starts."""
    smoothed: dict[str, Any] = {}

    def make(cell: Cell) -> Any:
        if cell.method == "smoothed" or cell.method == "optimise" and cell.kinds not in smoothed:
            smoothed.clear()
            smoothed[cell.kinds] = estimate(recording, "smoothed", cell.kinds)
        if cell.method == "smoothed":
            return smoothed[cell.kinds]
        return estimate(recording, cell.method, cell.kinds, smoothed.get(cell.kinds))

    for cell in group:
        yield cell, lambda cell=cell: make(cell)


def estimate(recording: Any, method: str, kinds: str, initial: Any = None, **settings: Any) -> Any:
    """Estimate by one of `METHODS`, with the recorded root pose; `settings` are the filter's."""
    import mocap_jax as mj

    if method == "optimise":
        options = mj.OptimiseOptions(kinds=kinds, root="given")
        # Without gyroscopes `optimise` makes a better guess than the smoothed filter of the row.
        start = initial if "G" in kinds else None
        return mj.optimise(recording, initial=start, options=options)
    process = "paper" if method == "ekf_paper" else "white_jerk"
    return mj.ekf(
        recording,
        options=mj.EkfOptions(
            kinds=kinds, root="given", process=process, smooth=method == "smoothed", **settings
        ),
    )


def run_all(cells: list[Cell], store: Store, workers: int, report: Report) -> None:
    """Compute all cells that the store lacks, in one or several processes."""
    run_groups(run_group, groups(cells), store, workers, report)

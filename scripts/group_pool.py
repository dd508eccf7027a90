"""Groups of cells in one process or several; the cells of a group share what was made for them."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from estimate_store import Cell, Store

C = TypeVar("C", bound=Cell)
Report = Callable[[C, str], None]
"""Called after each cell with what went wrong (empty if nothing did)."""
RunGroup = Callable[[list[C], Store, Report], None]
"""Computes the cells of a group, keeps each as soon as it is done, and reports it."""


def run_groups(
    run: RunGroup, groups: Sequence[list[C]], store: Store, workers: int, report: Report
) -> None:
    """Compute the cells that a store lacks.

    Args:
        run: a function of a module, so that other processes find it.
        groups: cells that belong together; groups without missing cells are left out.
        store: where results are kept.
        workers: processes.
        report: called in this process.
    """
    missing = [[cell for cell in group if not store.has(cell)] for group in groups]
    wanted = [group for group in missing if group]
    if workers == 1 or len(wanted) < 2:
        for group in wanted:
            run(group, store, report)
        return
    context = multiprocessing.get_context("spawn")
    done = context.Queue()
    with context.Pool(workers, _start_worker, (done, store.folder, run)) as pool:
        pending = pool.map_async(_work, wanted, chunksize=1)
        left = sum(len(group) for group in wanted)
        while left:
            cell, failure = done.get()
            report(cell, failure)
            left -= 1
        pending.get()


_worker: dict[str, Any] = {}


def _start_worker(done: Any, folder: Path, run: RunGroup) -> None:
    from mocap_jax.cli.main import prepare_process

    prepare_process()
    _worker.update(done=done, store=Store(folder), run=run)


def _work(group: list) -> None:
    _worker["run"](group, _worker["store"], lambda cell, said: _worker["done"].put((cell, said)))

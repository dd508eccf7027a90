"""Median times of jobs that are taken in turn, so that a busy machine hits all alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from statistics import median


def medians(
    jobs: Mapping[str, Callable[[], object]],
    repeats: int,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, float]:
    """Median seconds of every job, by its name.

    Args:
        jobs: called as often as all others; what compiles is called once before, by the caller.
        repeats: how often.
        clock: seconds; `time.thread_time` for processor seconds of the calling thread.
    """
    times: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(repeats):
        for name, job in jobs.items():
            start = clock()
            job()
            times[name].append(clock() - start)
    return {name: median(values) for name, values in times.items()}

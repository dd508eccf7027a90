"""Time of one optimiser iteration, over LAPACK's and with the border over without."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from statistics import median

import numpy as np

from benchmarks import lapack_band, recordings
from benchmarks.metric import Metric
from benchmarks.sequence_problem import Prepared, prepare

FRAMES = 1000
_REPEATS = 7
_DAMPING = 1e-3


def over_lapack() -> Metric:
    """Iteration without border over dpbtrf + dpbtrs of the same band matrix."""
    times, context = _measure()
    return Metric(
        "optimise_iteration_over_lapack", times["plain"] / times["lapack"], "ratio", "lower", 2.5,
        context | {"iteration_s": times["plain"], "lapack_s": times["lapack"]},
    )  # fmt: skip


def border_ratio() -> Metric:
    """Iteration with the sensors' constants over the one without."""
    times, context = _measure()
    return Metric(
        "border_cost_ratio", times["border"] / times["plain"], "ratio", "lower", 3.0,
        context | {"with_border_s": times["border"], "without_s": times["plain"]},
    )  # fmt: skip


@cache
def _measure() -> tuple[dict[str, float], dict[str, object]]:
    """Median seconds, the three taken in turn so that a busy machine hits all alike."""
    plain = prepare(recordings.walking(), FRAMES, border=False)
    border = prepare(recordings.walking(), FRAMES, border=True)
    band, rhs = _band_matrix(plain)
    jobs: dict[str, Callable[[], object]] = {"plain": plain.iterate, "border": border.iterate}
    for job in jobs.values():
        job()  # compile
    times: dict[str, list[float]] = {name: [] for name in (*jobs, "lapack")}
    for _ in range(_REPEATS):
        for name, job in jobs.items():
            times[name].append(_seconds(job))
        matrix, vector = band.copy(order="F"), rhs.copy()
        times["lapack"].append(_seconds(lambda m=matrix, v=vector: lapack_band.solve(m, v)))
    context = plain.context | {"constants": border.context["constants"], "repeats": _REPEATS}
    return {name: median(values) for name, values in times.items()}, context


def _band_matrix(prepared: Prepared) -> tuple[np.ndarray, np.ndarray]:
    equations = prepared.problem.linearise(prepared.state)
    return lapack_band.pack(equations.lower, _DAMPING), -equations.gradient.ravel()


def _seconds(job: Callable[[], object]) -> float:
    start = time.perf_counter()
    job()
    return time.perf_counter() - start

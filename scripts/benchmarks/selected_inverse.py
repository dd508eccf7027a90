"""Time of all covariances of poses over that of one factorisation of the same matrix."""

from __future__ import annotations

import time

import numpy as np

from benchmarks import recordings
from benchmarks.metric import Metric
from benchmarks.sequence_problem import prepare
from benchmarks.turns import medians
from mocap_jax import linalg

FRAMES = 1000
_REPEATS = 7


def selected_inverse() -> Metric:
    """Marginals of poses, and with neighbours, without and with the sensors' constants."""
    ratios: dict[str, float] = {}
    seconds: dict[str, float] = {}
    for name in ("plain", "border"):
        prepared = prepare(recordings.walking(), FRAMES, border=name == "border")
        equations = prepared.problem.linearise(prepared.state)
        # Blocks made once: only linear algebra is compared.
        blocks = _blocks(equations.border, FRAMES)
        lower, corner, context = np.array(equations.lower), equations.corner, prepared.context
        factor = lambda lower=lower, c=corner, b=blocks: linalg.factor(lower, c, b)  # noqa: E731
        f = factor()
        jobs = {
            "factor": factor,
            "poses": lambda f=f, b=blocks: linalg.marginals(f, b),
            "pairs": lambda f=f, b=blocks: linalg.pair_marginals(f, b),
        }
        # Processor seconds of this thread (one BLAS thread).
        times = medians(jobs, _REPEATS, time.thread_time)
        seconds[name] = times["factor"]
        ratios |= {f"{name}_{job}": times[job] / times["factor"] for job in ("poses", "pairs")}
    worst = max(ratios.values())
    return Metric(
        "selected_inverse_over_factor", worst, "ratio", "lower", 3.0,
        context | ratios | {f"{name}_factor_s": s for name, s in seconds.items()},
    )  # fmt: skip


def _blocks(border: linalg.BorderBlocks | None, frames: int) -> linalg.BorderBlocks | None:
    if border is None:
        return None
    kept = [np.array(border(k), float) for k in range(frames)]
    return kept.__getitem__

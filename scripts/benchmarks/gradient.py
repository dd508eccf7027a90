"""Time of a gradient through the whole-sequence solve over that of one of its iterations."""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median

import jax

import mocap_jax as mj
from benchmarks import recordings
from benchmarks.metric import Metric
from benchmarks.sequence_problem import iterate
from mocap_jax.estimate.whole_sequence import solve_sequence
from mocap_jax.recording import Recording

FRAMES = 1000
_REPEATS = 5


def gradient_ratio() -> Metric:
    """`jax.grad` by all parameters at once over one iteration of `optimise`, both compiled."""
    recording = recordings.of_duration(FRAMES / 140.0)
    options = mj.OptimiseOptions(covariance=False)
    solution, run = solve_sequence(recording, options=options)
    estimate = mj.differentiable(recording, initial=solution, options=options)
    loss = lambda p: (estimate(p).q ** 2).sum()  # noqa: E731
    jobs: dict[str, Callable[[], object]] = {
        "iteration": lambda: iterate(run.problem, run.state),
        "gradient": lambda: jax.block_until_ready(jax.grad(loss)(estimate.parameters)),
    }
    times = _medians(jobs)
    context = _size(recording, solution) | {f"{k}_s": v for k, v in times.items()}
    return Metric(
        "gradient_over_iteration", times["gradient"] / times["iteration"], "ratio", "lower", 3.0,
        context,
    )  # fmt: skip


def _medians(jobs: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Median seconds after a first call, jobs taken in turn."""
    times: dict[str, list[float]] = {name: [] for name in jobs}
    for turn in range(_REPEATS + 1):
        for name, job in jobs.items():
            start = time.perf_counter()
            job()
            if turn:  # the first one compiles
                times[name].append(time.perf_counter() - start)
    return {name: median(values) for name, values in times.items()}


def _size(recording: Recording, solution: mj.Solution) -> dict[str, int]:
    frames, dof = len(solution.trajectory.q), solution.body.nv
    return {"frames": frames, "dof": dof} | recordings.size(recording)

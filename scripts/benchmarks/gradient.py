"""Time of a gradient through the whole-sequence solve over that of one of its iterations."""

from __future__ import annotations

from collections.abc import Callable

import jax

import mocap_jax as mj
from benchmarks import recordings
from benchmarks.metric import Metric
from benchmarks.sequence_problem import iterate
from benchmarks.turns import medians
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
    for job in jobs.values():
        job()  # compile
    times = medians(jobs, _REPEATS)
    context = _size(recording, solution) | {f"{k}_s": v for k, v in times.items()}
    return Metric(
        "gradient_over_iteration", times["gradient"] / times["iteration"], "ratio", "lower", 3.0,
        context,
    )  # fmt: skip


def _size(recording: Recording, solution: mj.Solution) -> dict[str, int]:
    frames, dof = len(solution.trajectory.q), solution.body.nv
    return {"frames": frames, "dof": dof} | recordings.size(recording)

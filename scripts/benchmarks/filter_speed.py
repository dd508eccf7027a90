"""How much faster than real time the filter runs, compiled."""

from __future__ import annotations

import time

import mocap_jax as mj
from benchmarks import recordings
from benchmarks.metric import Metric


def realtime_factor() -> Metric:
    """Seconds of recording filtered per second: the second call in one process."""
    recording = recordings.walking()
    mj.ekf(recording)
    start = time.perf_counter()
    solution = mj.ekf(recording)
    seconds = time.perf_counter() - start
    begin, end = recording.interval
    context = {
        "frames": len(solution.trajectory.time), "dof": solution.body.nv, "filter_s": seconds,
    }  # fmt: skip
    return Metric(
        "ekf_realtime_factor", (end - begin) / seconds, "ratio", "higher", 2.0,
        context | recordings.size(recording),
    )  # fmt: skip

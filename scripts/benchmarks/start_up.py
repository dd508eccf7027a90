"""From process start to the first result, without and with compiled programs on disk."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from functools import cache
from pathlib import Path

import mocap_jax as mj
from benchmarks import recordings
from benchmarks.metric import Metric
from mocap_jax.compilation_cache import VARIABLE

SECONDS = 10.0


def cold_start() -> Metric:
    """Process start to result with an empty compilation cache."""
    cold, _, context = _two_processes()
    return Metric("cold_start_s", cold, "s", "lower", 40.0, context)


def warm_overhead() -> Metric:
    """Process start to result with the cache filled, less the solve itself in steady state."""
    _, warm, context = _two_processes()
    steady = _steady_state()
    return Metric(
        "warm_overhead_s", warm - steady, "s", "lower", 8.0,
        context | {"warm_start_s": warm, "steady_state_s": steady},
    )  # fmt: skip


@cache
def _two_processes() -> tuple[float, float, dict[str, object]]:
    """Seconds of `mocap-jax reconstruct` with an empty cache and with the one it left."""
    recording = recordings.of_duration(SECONDS)
    begin, end = recording.interval
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "recording.mcap")
        mj.write_recording(path, recording)
        (cold, cold_cpu), (warm, warm_cpu) = (
            _reconstruct(path, Path(folder, "cache")) for _ in range(2)
        )
    # Processor time tells a busy machine from a slow program.
    context = {"recording_s": round(end - begin, 2), "cold_cpu_s": cold_cpu, "warm_cpu_s": warm_cpu}
    return cold, warm, context | recordings.size(recording)


def _reconstruct(path: Path, cache_folder: Path) -> tuple[float, float]:
    """Wall and processor seconds of one process."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("JAX_COMPILATION")}
    environment |= {VARIABLE: str(cache_folder)}
    command = [str(Path(sys.prefix, "bin", "mocap-jax")), "reconstruct", str(path)]
    start, before = time.perf_counter(), _cpu_of_children()
    subprocess.run(
        [*command, "-o", str(path.with_name("solution.mcap"))], check=True, env=environment,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    return time.perf_counter() - start, _cpu_of_children() - before


def _cpu_of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _steady_state() -> float:
    """Seconds of the second solve of one process (the default method, as the command runs it)."""
    recording = recordings.of_duration(SECONDS)
    mj.optimise(recording)
    start = time.perf_counter()
    mj.optimise(recording)
    return time.perf_counter() - start

"""Speed and memory of decoding ten minutes of waveforms, in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

import mocap_jax as mj
from benchmarks.metric import Metric
from mocap_jax.io import protobuf_messages as pb
from mocap_jax.io.raw_file import Piece, RawReader, write_raw
from mocap_jax.io.topics import ACOUSTIC, PULSE
from mocap_jax.simulation.raw.simulate_raw import simulate_raw
from mocap_jax.simulation.raw.transducer import SAMPLE_RATE_HZ

CLIP, PROFILE, SEED = "routine", "paper", 0
SECONDS = 600.0


def decode_speed() -> Metric:
    """Seconds of recording decoded a second, start-up and writing of the recording included."""
    seconds, _, context = _decoded()
    factor = context["recording_s"] / seconds
    return Metric("decode_realtime_factor", factor, "x", "higher", 5.0, context)


def decode_memory() -> Metric:
    """Largest resident size meanwhile."""
    _, peak, context = _decoded()
    return Metric("decode_peak_memory_gb_10_min", peak, "GB", "lower", 1.0, context)


@cache
def _decoded() -> tuple[float, float, dict[str, float]]:
    """Wall seconds and peak memory [GB] of `mocap-jax decode`."""
    with tempfile.TemporaryDirectory() as folder:
        short, path = Path(folder, "short.mcap"), Path(folder, "long.mcap")
        simulate_raw(mj.builtin_motion(CLIP), profile=PROFILE, seed=SEED).write(short)
        context = _repeat(short, path, SECONDS)
        code = "from mocap_jax.cli import main; raise SystemExit(main())"
        start = time.perf_counter()
        child = subprocess.Popen(
            [sys.executable, "-c", code, "decode", str(path), "-o", str(Path(folder, "out.mcap"))],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        _, status, used = os.wait4(child.pid, 0)
        seconds = time.perf_counter() - start
    if status:
        sys.exit(f"decode ended with status {status}")
    context["cpu_s"] = used.ru_utime + used.ru_stime
    return seconds, used.ru_maxrss * 1024 / 1e9, context  # Linux reports kibibytes


def _repeat(short: Path, path: Path, seconds: float) -> dict[str, float]:
    """A raw recording that plays another one over and over."""
    reader = RawReader(short)
    pulses = [pb.decode_pulse(p) for topic, p in reader.messages() if topic.startswith(PULSE)]
    recording = reader.recording()
    sources = recording.setup.sources
    emission = np.array([stamp - reader.start_utc_ns for stamp, _ in pulses]) / 1e9
    source = np.array([sources.index(name) for _, name in pulses])
    length = sum(piece.shape[1] for piece in _pieces(short, reader.wires))
    times = round(seconds * SAMPLE_RATE_HZ / length)
    period = length / SAMPLE_RATE_HZ

    def pieces() -> Iterator[Piece]:
        done = 0
        for _ in range(times):
            for piece in _pieces(short, reader.wires):
                yield done, piece
                done += piece.shape[1]

    write_raw(
        path, recording, reader.driver_box(), sample_rate_hz=SAMPLE_RATE_HZ, wires=reader.wires,
        pulse_time=np.concatenate([emission + k * period for k in range(times)]),
        pulse_source=np.tile(source, times), pieces=pieces(),
    )  # fmt: skip
    return {
        "recording_s": round(times * period, 1),
        "boards": len(reader.wires),
        "file_gb": round(path.stat().st_size / 1e9, 2),
    }


def _pieces(path: Path, wires: tuple[str, ...]) -> Iterator[np.ndarray]:
    """Samples of all wires, piece by piece, shape (r, count)."""
    held: dict[str, np.ndarray] = {}
    for topic, payload in RawReader(path).messages():
        if not topic.startswith(ACOUSTIC):
            continue
        held[topic[len(ACOUSTIC) :]] = pb.decode_waveform(payload)[2]
        if len(held) == len(wires):
            yield np.stack([held[name] for name in wires])
            held.clear()

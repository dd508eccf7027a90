"""Programs compiled in the second thread are those that the solve calls."""

from __future__ import annotations

import threading
from pathlib import Path

import jax
import numpy as np
from test_sequence_assembly import make

import mocap_jax as mj
from mocap_jax.estimate import background
from mocap_jax.estimate.background import wait_for
from mocap_jax.estimate.compile_clock import CompileClock
from mocap_jax.estimate.sequence.compile_ahead import compile_ahead

DEMO = Path(__file__).resolve().parents[2] / "data" / "demo.mcap"


def test_after_compiling_ahead_nothing_is_left_to_compile() -> None:
    problem, state = make(2, chunk=5)
    compiled: list[str] = []

    def count(event: str, duration: float, **about: object) -> None:
        if event.endswith("backend_compile_duration"):
            compiled.append(str(about.get("fun_name")))

    wait_for(compile_ahead(problem))
    jax.monitoring.register_event_duration_secs_listener(count)
    try:
        equations = problem.linearise(state)
        assert np.isfinite(equations.border(0)).all()
        problem.cost(state)
    finally:
        jax.monitoring.unregister_event_duration_listener(count)
    assert not {name for name in compiled if "chunk" in name}


def test_waiting_counts_as_compilation_once() -> None:
    problem, _ = make(2, chunk=6)
    clock = CompileClock()
    with clock:
        wait_for(compile_ahead(problem))
    first, clock = clock.seconds, CompileClock()
    with clock:
        wait_for(compile_ahead(problem))
    assert first > 0
    assert clock.seconds < 1e-3


def test_the_filters_programs_are_those_that_its_loops_call(monkeypatch) -> None:
    """Compiled from declared poses in the background, they fit what the rest hold gives."""
    monkeypatch.setattr(background, "_seen", set())
    # What JAX has on disk would be compiled twice: see `stored_programs`.
    folder = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", None)
    recording = mj.read_recording(DEMO)
    options = mj.EkfOptions(smooth=True, covariance=False, chunk=37)
    compiled: list[tuple[str, str]] = []

    def count(event: str, duration: float, **about: object) -> None:
        if event.endswith("backend_compile_duration") and "chunk" in str(about.get("fun_name")):
            compiled.append((threading.current_thread().name, str(about["fun_name"])))

    jax.monitoring.register_event_duration_secs_listener(count)
    try:
        mj.ekf(recording, options=options)
    finally:
        jax.monitoring.unregister_event_duration_listener(count)
        jax.config.update("jax_compilation_cache_dir", folder)
    assert [name for _, name in compiled] == ["jit(filter_chunk)", "jit(smooth_chunk)"]
    assert all(thread.startswith("compile") for thread, _ in compiled)

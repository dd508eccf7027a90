"""Compile a problem's programs in a thread of their own while the initial guess is made."""

from __future__ import annotations

import contextlib
import time
from threading import Thread

import jax
import numpy as np

from mocap_jax.estimate import compile_clock
from mocap_jax.estimate.sequence.assemble import assemble_chunk, chunk_border, evaluate_chunk
from mocap_jax.estimate.sequence.layout import Constants, Geometry
from mocap_jax.estimate.sequence.problem import SequenceProblem

_compiled: set[object] = set()


class CompileAhead:
    """Runs the traced functions once on the first chunk, beside the caller."""

    def __init__(self, problem: SequenceProblem) -> None:
        self._thread: Thread | None = None
        if problem.program not in _compiled:
            _compiled.add(problem.program)
            self._thread = Thread(target=_run, args=(problem,))
            self._thread.start()

    def wait(self) -> None:
        """Return when all is compiled; the time counts as compilation."""
        if self._thread is not None:
            begin = time.perf_counter()
            self._thread.join()
            compile_clock.add(time.perf_counter() - begin)


def _run(problem: SequenceProblem) -> None:
    layout, dtype = problem.layout, problem.dtype
    terms = problem.chunk_terms(0)
    zero = np.zeros((len(layout.sites), 3), dtype)
    lengths, sources, sound, emitters = (np.zeros(n, dtype) for n in layout.geometry_sizes)
    geometry = Geometry(lengths, sources.reshape(-1, 3), sound, emitters)
    mounting = np.tile(np.eye(3, dtype=dtype), (len(zero), 1, 1))
    constants = jax.tree.map(jax.numpy.asarray, Constants(zero, zero, mounting, zero, geometry))
    arguments = (problem.body, np.asarray(terms.reference[0]), constants, terms, problem.weights)
    # Whatever fails here fails again, and is reported, where its result is wanted.
    with contextlib.suppress(Exception):
        out = assemble_chunk(layout, *arguments)
        if layout.use_border:
            chunk_border(layout, *out.border_parts)
        jax.block_until_ready(evaluate_chunk(layout, *arguments))

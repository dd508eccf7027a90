"""Compile a problem's programs in a thread of their own while the initial guess is made."""

from __future__ import annotations

import contextlib
import time
from threading import Thread

import jax
import numpy as np

from mocap_jax.estimate import compile_clock
from mocap_jax.estimate.sequence.assemble import assemble_chunk, chunk_border, evaluate_chunk
from mocap_jax.estimate.sequence.layout import Constants
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
    constants = Constants(zero, zero, np.tile(np.eye(3, dtype=dtype), (len(zero), 1, 1)), zero)
    constants = jax.tree.map(jax.numpy.asarray, constants)
    arguments = (problem.body, np.asarray(terms.reference[0]), constants, terms, problem.weights)
    # Whatever fails here fails again, and is reported, where its result is wanted.
    with contextlib.suppress(Exception):
        out = assemble_chunk(layout, *arguments)
        if layout.use_border:
            compact = (np.asarray(x) for x in (out.border, out.screws, out.range_border))
            chunk_border(layout, *compact)
        jax.block_until_ready(evaluate_chunk(layout, *arguments))

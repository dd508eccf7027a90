"""Compile a problem's programs in the background while the initial guess is made."""

from __future__ import annotations

from concurrent.futures import Future

import jax
import numpy as np

from mocap_jax.estimate.background import compile_once
from mocap_jax.estimate.sequence.assemble import assemble_chunk, chunk_border, evaluate_chunk
from mocap_jax.estimate.sequence.constants import no_errors
from mocap_jax.estimate.sequence.problem import SequenceProblem


def compile_ahead(problem: SequenceProblem) -> list[Future[None]]:
    """Queue the programs for chunks like the first one."""
    return compile_once(problem.program, lambda: _prepare(problem))


def _prepare(problem: SequenceProblem) -> None:
    layout, dtype = problem.layout, problem.dtype
    terms = problem.chunked.chunk(0)
    constants = jax.tree.map(lambda x: jax.numpy.asarray(x, dtype), no_errors(layout))
    arguments = (problem.body, np.asarray(terms.reference[0]), constants, terms, problem.weights)
    out = assemble_chunk.prepare(layout, *arguments)
    if layout.use_border:
        chunk_border.prepare(layout, *out.border_parts)
    evaluate_chunk.prepare(layout, *arguments)

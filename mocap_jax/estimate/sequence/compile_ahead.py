"""Compile a problem's programs in the background while the initial guess is made."""

from __future__ import annotations

from concurrent.futures import Future

import jax
import numpy as np

from mocap_jax.estimate.background import compile_once
from mocap_jax.estimate.sequence.assemble import assemble_chunk, chunk_border, evaluate_chunk
from mocap_jax.estimate.sequence.layout import Constants, Geometry
from mocap_jax.estimate.sequence.problem import SequenceProblem


def compile_ahead(problem: SequenceProblem) -> list[Future[None]]:
    """Queue running the traced functions once on the first chunk."""
    return compile_once(problem.program, lambda: _run(problem))


def _run(problem: SequenceProblem) -> None:
    layout, dtype = problem.layout, problem.dtype
    terms = problem.chunk_terms(0)
    zero = np.zeros((len(layout.sites), 3), dtype)
    lengths, sources, sound, emitters = (np.zeros(n, dtype) for n in layout.geometry_sizes)
    geometry = Geometry(lengths, sources.reshape(-1, 3), sound, emitters)
    mounting = np.tile(np.eye(3, dtype=dtype), (len(zero), 1, 1))
    constants = jax.tree.map(jax.numpy.asarray, Constants(zero, zero, mounting, zero, geometry))
    arguments = (problem.body, np.asarray(terms.reference[0]), constants, terms, problem.weights)
    out = assemble_chunk(layout, *arguments)
    if layout.use_border:
        chunk_border(layout, *out.border_parts)
    jax.block_until_ready(evaluate_chunk(layout, *arguments))

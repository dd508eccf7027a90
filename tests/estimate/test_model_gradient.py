"""Products with J agree with the assembled normal equations where these are well conditioned."""

from __future__ import annotations

import numpy as np
import pytest
from test_sequence_assembly import CORRECTIONS, T, dense, make

from mocap_jax.estimate.sequence.model_gradient import model_gradient


@pytest.mark.slow
@pytest.mark.parametrize("corrections", [None, CORRECTIONS])
def test_model_gradient_is_that_of_the_normal_equations(corrections: dict | None) -> None:
    problem, state = make(
        3, losses="cauchy", user=True, chunk=4, corrections=corrections, gravity=True
    )
    equations = problem.linearise(state)
    gradient = np.concatenate([equations.gradient.ravel(), equations.corner_gradient])
    rng = np.random.default_rng(0)
    x = rng.normal(size=equations.gradient.shape)
    z = rng.normal(size=len(gradient) - x.size)
    assert x.shape[0] == T and len(z) == problem.layout.constants
    product = dense(equations, T) @ np.concatenate([x.ravel(), z])
    for offset, expected in ((True, gradient + product), (False, product)):
        chunks = problem._inputs(state)
        got = model_gradient(problem.layout, chunks, problem.weights, x, z, offset=offset)
        got = np.concatenate([part.ravel() for part in got])
        np.testing.assert_allclose(got, expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())

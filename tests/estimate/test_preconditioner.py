"""The traced solve of factored arrow equations against dense algebra."""

from __future__ import annotations

import jax
import numpy as np
import pytest

from mocap_jax import linalg
from mocap_jax.estimate.derivatives.objective import Step
from mocap_jax.estimate.derivatives.preconditioner import preconditioner

T, D, B = 9, 4, 2


@pytest.mark.parametrize("m", [0, 3])
def test_it_solves_the_factored_equations(m: int) -> None:
    rng = np.random.default_rng(m)
    n = T * D
    beside, corner = rng.normal(size=(n, m)), 30 * np.eye(m)
    lower = np.zeros((T, B + 1, D, D))
    banded = 20 * np.eye(n)
    for k in range(T):
        for o in range(min(B + 1, T - k)):
            rows, columns = slice((k + o) * D, (k + o + 1) * D), slice(k * D, (k + 1) * D)
            block = rng.normal(size=(D, D))
            banded[rows, columns] += block + block.T if o == 0 else block
            if o:
                banded[columns, rows] = banded[rows, columns].T
            lower[k, o] = banded[rows, columns]
    border = (lambda k: np.ascontiguousarray(beside[k * D : (k + 1) * D].T)) if m else None
    f = linalg.factor(lower, corner if m else None, border)
    x, z = rng.normal(size=(5, T, D)), rng.normal(size=(5, m))
    got = jax.jit(jax.vmap(preconditioner(f, border).solve))(Step(x, z))
    whole = np.block([[banded, beside], [beside.T, corner]])
    right = np.concatenate([x.reshape(5, -1), z], axis=1)
    found = np.concatenate([np.reshape(got.x, (5, -1)), got.z], axis=1)
    np.testing.assert_allclose(found @ whole, right, atol=1e-12)

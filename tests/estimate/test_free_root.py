"""Nothing measures the root: the refined linear step equals a QR factorisation of J.

`scripts/check_root_free` does the same for longer sequences.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
from checks.free_root import householder, measure


def test_householder_triangle() -> None:
    a = np.random.default_rng(0).normal(size=(9, 4))
    r = householder(a)
    np.testing.assert_allclose(r.T @ r, a.T @ a, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(np.tril(r, -1), 0)


@pytest.mark.slow
def test_refined_step_is_that_of_qr() -> None:
    errors = measure(600, border=True)
    assert errors.refined < 1e-8
    assert errors.refined < 1e-2 * errors.cholesky

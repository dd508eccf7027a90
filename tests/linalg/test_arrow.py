"""The arrow solver against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax import linalg
from mocap_jax.errors import SolveError
from mocap_jax.linalg import arrow


@pytest.mark.parametrize(
    ("t", "d", "b", "m"), [(7, 3, 2, 4), (1, 4, 2, 2), (9, 2, 3, 0), (6, 5, 1, 3)]
)
def test_solve_and_covariance_equal_dense(t: int, d: int, b: int, m: int, random_arrow) -> None:
    dense, lower, corner, border = random_arrow(t, d, b, m)
    blocks = (lambda k: border[k]) if m else None
    f = linalg.factor(lower, corner if m else None, blocks)
    rhs = np.random.default_rng(1).normal(size=t * d + m)
    x, z = linalg.solve(f, rhs[: t * d].reshape(t, d), rhs[t * d :], blocks)
    np.testing.assert_allclose(
        np.concatenate([x.ravel(), z]), np.linalg.solve(dense, rhs), rtol=1e-9
    )
    inverse = np.linalg.inv(dense)
    marginals = linalg.marginals(f, blocks)
    for k in range(t):
        block = inverse[k * d : (k + 1) * d, k * d : (k + 1) * d]
        np.testing.assert_allclose(marginals[k], block, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(linalg.corner_covariance(f), inverse[t * d :, t * d :], rtol=1e-9)


def test_border_covariance_across_stretches_equals_dense(random_arrow, monkeypatch) -> None:
    monkeypatch.setattr(arrow, "STRETCH", 3)
    dense, lower, corner, border = random_arrow(10, 3, 2, 4)
    f = linalg.factor(lower, corner, lambda k: border[k])
    inverse = np.linalg.inv(dense)[:30, :30].reshape(10, 3, 10, 3)
    for k, found in enumerate(linalg.marginals(f, lambda k: border[k])):
        np.testing.assert_allclose(found, inverse[k, :, k], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("t", "d", "b", "m"),
    [(12, 3, 2, 4), (2, 3, 2, 0), (1, 4, 2, 2), (9, 2, 3, 0), (6, 5, 1, 3), (8, 3, 5, 2)],
)
def test_pairs_of_neighbours_equal_dense(
    t: int, d: int, b: int, m: int, random_arrow, monkeypatch
) -> None:
    monkeypatch.setattr(arrow, "STRETCH", 4)
    dense, lower, corner, border = random_arrow(t, d, b, m)
    blocks = (lambda k: border[k]) if m else None
    f = linalg.factor(lower, corner if m else None, blocks)
    marginals, pairs = linalg.pair_marginals(f, blocks)
    inverse = np.linalg.inv(dense)[: t * d, : t * d].reshape(t, d, t, d)
    assert pairs.shape == (t - 1, d, d)
    scale = np.abs(inverse).max()
    for k in range(t):
        np.testing.assert_allclose(marginals[k], inverse[k, :, k], atol=1e-9 * scale, rtol=0)
    for k in range(t - 1):
        np.testing.assert_allclose(pairs[k], inverse[k + 1, :, k], atol=1e-9 * scale, rtol=0)
    np.testing.assert_array_equal(marginals, linalg.marginals(f, blocks))


def test_factoring_in_pieces_as_blocks_arrive(random_arrow) -> None:
    _, lower, corner, border = random_arrow(9, 3, 2, 4)
    whole = linalg.factor(lower, corner, lambda k: border[k], damping=0.1)
    arriving = np.full_like(lower, np.nan)
    pieces = linalg.Factoring(arriving, lambda k: border[k], damping=0.1, overwrite=True)
    for stop in (4, 6):
        arriving[pieces.done : stop] = lower[pieces.done : stop]
        pieces.advance(stop)
    arriving[6:] = lower[6:]
    found = pieces.finish(corner)
    np.testing.assert_array_equal(found.corner, whole.corner)
    np.testing.assert_array_equal(found.panels[:-2], whole.panels[:-2])


def test_damping_adds_to_the_diagonal(random_arrow) -> None:
    dense, lower, corner, border = random_arrow(5, 3, 2, 2)
    f = linalg.factor(lower, corner, lambda k: border[k], damping=0.7)
    rhs = np.arange(17.0)
    x, z = linalg.solve(f, rhs[:15].reshape(5, 3), rhs[15:], lambda k: border[k])
    expected = np.linalg.solve(dense + 0.7 * np.eye(17), rhs)
    np.testing.assert_allclose(np.concatenate([x.ravel(), z]), expected, rtol=1e-9)


def test_many_right_hand_sides(random_arrow) -> None:
    dense, lower, _, _ = random_arrow(6, 3, 2, 0)
    rhs = np.random.default_rng(2).normal(size=(18, 4))
    x = linalg.solve_banded(linalg.factor(lower), rhs.reshape(6, 3, 4))
    np.testing.assert_allclose(x.reshape(18, 4), np.linalg.solve(dense, rhs), rtol=1e-9)


def test_singular_matrix_is_an_error_naming_the_frame() -> None:
    lower = np.zeros((4, 2, 2, 2))
    lower[:2, 0] = np.eye(2)
    with pytest.raises(SolveError, match="frame 2"):
        linalg.factor(lower)


def test_marginals_survive_unequally_determined_unknowns() -> None:
    """Double integrators with tiny and huge information side by side, as unobserved joints make."""
    t, d = 400, 4
    rng = np.random.default_rng(0)
    weak = np.array([1e-6, 1e-6, 1e2, 1e8])
    mix = np.linalg.qr(rng.normal(size=(d, d)))[0]
    lower = np.zeros((t, 3, d, d))
    for k in range(t):
        lower[k, 0] += mix @ np.diag(weak) @ mix.T
    for k in range(1, t - 1):
        for i, a in enumerate((1.0, -2.0, 1.0)):
            for j, c in enumerate((1.0, -2.0, 1.0)[: i + 1]):
                lower[k - 1 + j, i - j] += 1e6 * a * c * np.eye(d)
    f = linalg.factor(lower)
    found = linalg.marginals(f)
    for k in (0, 200, 399):
        rhs = np.zeros((t, d, d))
        rhs[k] = np.eye(d)
        np.testing.assert_allclose(found[k], linalg.solve_banded(f, rhs)[k], rtol=1e-5, atol=1e-12)


def test_single_precision_border_is_eliminated_all_the_same() -> None:
    rng = np.random.default_rng(3)
    t, d, m = 6, 3, 4
    wide = rng.normal(size=(t, 3, d, d)) * 0.1
    wide[:, 0] = wide[:, 0] @ np.swapaxes(wide[:, 0], 1, 2) + 5 * np.eye(d)
    border = rng.normal(size=(t, m, d)).astype(np.float32)
    corner = 50 * np.eye(m)
    single = linalg.factor(wide, corner, lambda k: border[k])
    double = linalg.factor(wide, corner, lambda k: border[k].astype(float))
    np.testing.assert_allclose(single.corner, double.corner, rtol=1e-12)

"""Which axes a joint turns about: what its relative rate spans.

The rate of the second sensor relative to the first, in the first's frame, is w = R w2 - w1. Of a
hinge it lies along an axis fixed in both frames; of a universal (two-axis) joint in the plane of an
axis a1 fixed in the first and an axis a2 fixed in the second frame, w . (a1 x R a2) = 0; of a ball
joint anywhere. Rates do not drift, so this holds at any time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

# Of this many samples at most the axes of a two-axis joint are sought, before all refine them.
_FEW = 600
# Axes of a universal joint closer than this span no plane (sine of the angle between them).
_PARALLEL = 0.1


class Axes(NamedTuple):
    """Axes in both frames, and how much of the relative rate is off them."""

    first: Float[np.ndarray, "3"]
    second: Float[np.ndarray, "3"]
    std: Float[np.ndarray, "2"]
    """Deviation of each axis, about the worse direction across it [rad]."""
    off: float
    """Root mean square relative rate off the axes, over that of all of it."""


class Motion(NamedTuple):
    """Relative motion in windows."""

    R_first_second: Float[np.ndarray, "w n 3 3"]
    rate: Float[np.ndarray, "w n 3"]
    """Of the second relative to the first, in the first's frame [rad/s]."""
    size: float
    """Its root mean square [rad/s]."""


def relative_rate(
    R_first_second: Float[np.ndarray, "w n 3 3"], rate: Float[np.ndarray, "w 2 n 3"]
) -> Float[np.ndarray, "w n 3"]:
    """Rate of the second sensor relative to the first, in the first's frame [rad/s]."""
    return np.einsum("wnij,wnj->wni", R_first_second, rate[:, 1]) - rate[:, 0]


def hinge_axes(motion: Motion) -> Axes:
    """The one axis along which the relative rate lies, in both frames."""
    in_second = np.einsum("wnji,wnj->wni", motion.R_first_second, motion.rate)
    axes, stds, off = [], [], []
    for rate in (motion.rate, in_second):
        axis = np.linalg.eigh(np.einsum("wni,wnj->ij", rate, rate))[1][:, -1]
        along = rate @ axis
        across = rate - along[..., None] * axis
        # Scores of windows: errors of rates last, samples are not independent.
        scores = np.einsum("wni,wn->wi", across, along)
        scale = (along**2).sum()
        axes.append(axis)
        stds.append(_largest(scores.T @ scores / scale**2))
        off.append((across**2).sum(-1).mean())
    first, second = axes
    first = first * _sign(first)
    alike = np.einsum("i,wnij,j->", first, motion.R_first_second, second)
    return Axes(
        first, second * np.sign(alike), np.array(stds), float(np.sqrt(np.mean(off))) / motion.size
    )


def universal_axes(motion: Motion) -> Axes:
    """Two axes, one fixed in each frame, in whose plane the relative rate lies."""
    R = motion.R_first_second.reshape(-1, 3, 3)
    rate = motion.rate.reshape(-1, 3)
    few = slice(None, None, max(1, len(R) // _FEW))
    starts = [(np.eye(3)[i], np.eye(3)[j]) for i in range(3) for j in range(3)]
    coarse = [_fit(R[few], rate[few], a, b) for a, b in starts]
    best = min(coarse, key=lambda fit: fit[0])
    cost, first, second, J = _fit(R, rate, *best[1:3])
    error = _off_plane(np.concatenate([first, second]), R, rate)
    shape = (*motion.rate.shape[:2], 6)
    scores = np.einsum("wng,wn->wg", J.reshape(shape), error.reshape(shape[:2]))
    inverse = np.linalg.pinv(J.T @ J)
    covariance = inverse @ scores.T @ scores @ inverse
    std = np.array([_largest(covariance[:3, :3]), _largest(covariance[3:, 3:])])
    first = first * (sign := _sign(first))
    # The signs of both axes are free; the second's makes the usual angle between them sharp.
    alike = np.einsum("i,nij,j->", first, R, second)
    second = second * (np.sign(alike) or sign)
    return Axes(first, second, std, float(np.sqrt(2 * cost / len(R))) / motion.size)


def _fit(
    R: np.ndarray, rate: np.ndarray, first: np.ndarray, second: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Cost, both unit axes, and derivatives of the errors by them (n, 6)."""
    from scipy.optimize import least_squares  # slow to import

    fit = least_squares(
        lambda axes: _off_plane(axes, R, rate), np.concatenate([first, second]),
        jac=lambda axes: _off_plane_by_axes(axes, R, rate), max_nfev=60,
    )  # fmt: skip
    axes = np.concatenate([v / np.linalg.norm(v) for v in fit.x.reshape(2, 3)])
    return float(fit.cost), axes[:3], axes[3:], _off_plane_by_axes(axes, R, rate)


def _off_plane(axes: np.ndarray, R: np.ndarray, rate: np.ndarray) -> Float[np.ndarray, "n"]:
    """Part of the relative rate across the plane of both axes [rad/s]."""
    a, b = (v / np.linalg.norm(v) for v in axes.reshape(2, 3))
    normal = np.cross(a, R @ b)
    size = np.maximum(np.linalg.norm(normal, axis=-1), _PARALLEL)
    return (rate * normal).sum(-1) / size


def _off_plane_by_axes(
    axes: np.ndarray, R: np.ndarray, rate: np.ndarray
) -> Float[np.ndarray, "n 6"]:
    """Derivatives of `_off_plane`, by axes of any length."""
    sizes = [np.linalg.norm(v) for v in axes.reshape(2, 3)]
    a, b = (v / n for v, n in zip(axes.reshape(2, 3), sizes, strict=True))
    other = R @ b
    normal = np.cross(a, other)
    size = np.linalg.norm(normal, axis=-1, keepdims=True)
    off = (rate * normal).sum(-1, keepdims=True)
    free = size > _PARALLEL
    across = np.where(free, rate - off * normal / np.maximum(size, _PARALLEL) ** 2, rate)
    across = across / np.maximum(size, _PARALLEL)
    by_first = np.cross(other, across)
    by_second = np.einsum("nji,nj->ni", R, np.cross(across, a))
    parts = [
        (d - (d @ v)[:, None] * v) / n
        for d, v, n in zip((by_first, by_second), (a, b), sizes, strict=True)
    ]
    return np.concatenate(parts, axis=1)


def _sign(axis: np.ndarray) -> float:
    """Sign that makes the largest component positive."""
    return 1.0 if axis[np.abs(axis).argmax()] > 0 else -1.0


def _largest(covariance: np.ndarray) -> float:
    return float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0)))

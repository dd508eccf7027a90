"""Where a joint's centre is in two sensors' frames: both must accelerate alike there.

With r the arm from a sensor to the joint, w its rate and f its specific force,

    f_joint = f + turn(w) r,    turn(w) r = w' x r + w x (w x r),

and both sensors' f_joint differ by their relative orientation alone. Their norms need none (Seel,
Schauer, Raisch 2012, IEEE CCA, 242-249): they make the start. Then, in each window, integrated
rates carry both forces to the frames at its start, which differ by one constant rotation; arms,
biases, the clocks' difference and these rotations follow by Gauss-Newton, the rotations
eliminated.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.initialise.joint.options import JointOptions
from mocap_jax.initialise.joint.readings import Pair

_STEPS, _ENOUGH = 15, 1e-7
# Residuals beyond this many deviations count less (Huber).
_HUBER = 3.0
# Median of the norm of three standard normal numbers.
_MEDIAN = 1.538
_ARMS, _CONSTANTS = 6, 19
# About so many samples are enough for the start.
_FEW = 1500


class Centre(NamedTuple):
    """Lever arms, biases and relative orientation."""

    constants: Float[np.ndarray, "19"]
    """Arms of both sensors [m], biases of gyroscopes [rad/s], of accelerometers [m/s^2], and what
    the second's stamps say less the first's [s]."""
    arm_covariance: Float[np.ndarray, "6 6"]
    """[m^2], from the scatter between windows."""
    arm_information: Float[np.ndarray, "6 6"]
    """Sums of squared derivatives by the arms, all else eliminated [s^-4]."""
    noise_information: float
    """What noise of the angular accelerations adds to each direction of it."""
    R_start: Float[np.ndarray, "w 2 n 3 3"]
    """Of each sensor, from its frame to that at the start of the window."""
    R_first_second: Float[np.ndarray, "w n 3 3"]
    force: Float[np.ndarray, "w n 3"]
    """Specific force in the joint, in the first sensor's frame at the start of the window."""
    residual: float
    """Root mean square of a component of what the two sensors differ by in the joint [m/s^2],
    robust."""


class _Linear(NamedTuple):
    """Residuals and their derivatives, weighted: by constants and by the windows' rotations."""

    residual: Float[np.ndarray, "w m"]
    constants: Float[np.ndarray, "w m 19"]
    rotations: Float[np.ndarray, "w m 3"]
    variance: float
    weight: Float[np.ndarray, "w n"]


def joint_centre(pair: Pair, options: JointOptions) -> Centre:
    """Lever arms of two sensors to their common joint, from motion alone."""
    constants = np.concatenate([_arms_by_norm(pair), np.zeros(_CONSTANTS - _ARMS)])
    R_between = _first_rotations(pair, constants)
    sigma = np.repeat(
        [options.arm_sigma, options.gyroscope_bias_sigma, options.accelerometer_bias_sigma,
         options.clock_sigma], [6, 6, 6, 1],
    )  # fmt: skip
    for _ in range(_STEPS):
        linear = _linearise(pair, constants, R_between)
        H, g, back = _eliminate(linear)
        prior = linear.variance / sigma**2
        step = -np.linalg.solve(H + np.diag(prior), g.sum(0) + prior * constants)
        turns = back[..., 0] + np.einsum("wig,g->wi", back[..., 1:], step)
        constants = constants + step
        R_between = Rotation.from_rotvec(-turns).as_matrix() @ R_between
        if np.abs(step[:_ARMS]).max() < _ENOUGH:
            break
    return _result(pair, constants, R_between, sigma)


def _result(pair: Pair, constants: np.ndarray, R_between: np.ndarray, sigma: np.ndarray) -> Centre:
    """Everything about the solution."""
    linear = _linearise(pair, constants, R_between)
    H, g, _ = _eliminate(linear)
    prior = np.diag(linear.variance / sigma**2)
    inverse = np.linalg.inv(H + prior)
    # Errors last (derivatives, scales, timing): windows are what is independent, not samples.
    windows = len(g)
    scatter = g.T @ g * windows / max(windows - 1, 1) if windows > 3 else H * linear.variance
    covariance = inverse @ (scatter + prior * linear.variance) @ inverse
    rest = np.linalg.solve(H[_ARMS:, _ARMS:] + prior[_ARMS:, _ARMS:], H[_ARMS:, :_ARMS])
    information = H[:_ARMS, :_ARMS] - H[:_ARMS, _ARMS:] @ rest
    R_start, force, _ = _carried(pair, constants)
    R1, R2 = R_start[:, 0], R_start[:, 1]
    return Centre(
        constants, covariance[:_ARMS, :_ARMS], information,
        float(2 * pair.turn_noise**2 * linear.weight.sum()), R_start,
        np.einsum("wnji,wjk,wnkl->wnil", R1, R_between, R2), force[:, 0],
        float(np.sqrt(linear.variance)),
    )  # fmt: skip


def lever(rate: Float[np.ndarray, "*b 3"], turn: Float[np.ndarray, "*b 3"]) -> np.ndarray:
    """Matrix that takes an arm to the acceleration of its end over its start (*b, 3, 3)."""
    W = _skew(rate)
    return _skew(turn) + W @ W


def _arms_by_norm(pair: Pair) -> Float[np.ndarray, "6"]:
    """Arms for which both specific forces in the joint are of the same size."""
    from scipy.optimize import least_squares  # slow to import

    few = max(1, pair.known.sum() // _FEW)
    force, rate, turn = (
        np.moveaxis(x, 1, 2)[pair.known][::few] for x in (pair.force, pair.rate, pair.turn)
    )
    K = lever(rate, turn)

    def difference(arms: np.ndarray) -> np.ndarray:
        size = np.linalg.norm(force + np.einsum("nsij,sj->nsi", K, arms.reshape(2, 3)), axis=-1)
        return size[:, 0] - size[:, 1]

    # Not from zero, where opposite arms are alike in every turn about the sensors.
    starts = [s * np.eye(3)[i] for i in range(3) for s in (0.1, -0.1)]
    fits = [
        least_squares(difference, np.concatenate([a, -a]), loss="soft_l1", f_scale=0.5, max_nfev=30)
        for a in starts
    ]
    return min(fits, key=lambda fit: fit.cost).x


def _first_rotations(pair: Pair, constants: np.ndarray) -> Float[np.ndarray, "w 3 3"]:
    """Relative orientation at the start of each window, by the forces that both see (Wahba)."""
    _, force, _ = _carried(pair, constants)
    B = np.einsum("wni,wnj,wn->wij", force[:, 0], force[:, 1], pair.known)
    U, _, Vt = np.linalg.svd(B)
    sign = np.ones((len(B), 3))
    sign[:, 2] = np.sign(np.linalg.det(U @ Vt))
    return (U * sign[:, None]) @ Vt


def _carried(pair: Pair, constants: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rotations to the start, forces in the joint there (w, 2, n, 3), and levers there."""
    arms, gyroscope, accelerometer = constants[:-1].reshape(3, 2, 3)
    shift = np.array([0.0, constants[-1]])[:, None, None]
    moved = pair.rate + shift * pair.turn
    rate = moved - gyroscope[None, :, None]
    R = _integrate(rate, pair.step)
    K = R @ lever(rate, pair.turn + shift * pair.turn_slope)
    felt = pair.force + shift * pair.force_slope - accelerometer[None, :, None]
    own = np.einsum("wsnij,wsnj->wsni", R, felt)
    return R, own + np.einsum("wsnij,sj->wsni", K, arms), K


def _integrate(rate: np.ndarray, step: float) -> Float[np.ndarray, "w 2 n 3 3"]:
    """Rotations from the start of each window, rates along straight lines between samples."""
    between = 0.5 * step * (rate[:, :, 1:] + rate[:, :, :-1])
    turns = Rotation.from_rotvec(between.reshape(-1, 3)).as_matrix()
    turns = turns.reshape(*between.shape, 3)
    R = np.empty((*rate.shape, 3))
    R[:, :, 0] = np.eye(3)
    for k in range(rate.shape[2] - 1):
        R[:, :, k + 1] = R[:, :, k] @ turns[:, :, k]
    return R


def _linearise(pair: Pair, constants: np.ndarray, R_between: np.ndarray) -> _Linear:
    """Difference of both forces in the joint, in the first sensor's frame at the start."""
    R, force, K = _carried(pair, constants)
    to_first = R_between[:, None]
    second = np.einsum("wij,wnj->wni", R_between, force[:, 1])
    residual = force[:, 0] - second
    drift = np.cumsum(R, axis=2) * pair.step
    # Later readings are carried to the same frame, but for a rotation that is free anyway.
    later = np.gradient(second, pair.step, axis=1)[..., None]
    derivative = np.concatenate(
        [
            K[:, 0], -to_first @ K[:, 1],
            _skew(force[:, 0]) @ drift[:, 0], -_skew(second) @ to_first @ drift[:, 1],
            -R[:, 0], to_first @ R[:, 1],
            -later,
        ],
        axis=-1,
    )  # fmt: skip
    size = np.linalg.norm(residual, axis=-1)
    sigma = max(float(np.median(size[pair.known])) / _MEDIAN, 1e-9)
    weight = pair.known * np.minimum(1.0, _HUBER * sigma / np.maximum(size, 1e-12))
    rows, by_constants, by_rotations = (
        _weighted(x, weight) for x in (residual, derivative, _skew(second))
    )
    return _Linear(rows, by_constants, by_rotations, sigma**2, weight)


def _weighted(rows: Float[np.ndarray, "w n 3 *g"], weight: Float[np.ndarray, "w n"]) -> np.ndarray:
    """Rows times the roots of their weights, those of a window one after another (w, 3n, *g)."""
    root = np.sqrt(weight).reshape(*weight.shape, *[1] * (rows.ndim - 2))
    return (rows * root).reshape(len(rows), -1, *rows.shape[3:])


def _eliminate(linear: _Linear) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal equations of the constants, each window's score, and how rotations follow."""
    L, G, r = linear.rotations, linear.constants, linear.residual
    right = np.concatenate([r[..., None], G], axis=-1)
    back = np.linalg.solve(
        np.einsum("wai,waj->wij", L, L), np.einsum("wai,wag->wig", L, right)
    )  # fmt: skip
    left = right - L @ back
    r, G = left[..., 0], left[..., 1:]
    H = np.einsum("wag,wah->gh", G, G)
    return H, np.einsum("wag,wa->wg", G, r), back


def _skew(v: Float[np.ndarray, "*b 3"]) -> Float[np.ndarray, "*b 3 3"]:
    S = np.zeros((*v.shape, 3))
    S[..., 0, 1], S[..., 0, 2] = -v[..., 2], v[..., 1]
    S[..., 1, 0], S[..., 1, 2] = v[..., 2], -v[..., 0]
    S[..., 2, 0], S[..., 2, 1] = -v[..., 1], v[..., 0]
    return S

"""Heading of a sensor relative to its neighbour's, from the acceleration of the joint between them.

Without a magnetometer each sensor's orientations have a heading of their own. Two sensors beside
one joint feel the acceleration of one point, the joint centre; in the world

    a_1 + K_1 r_1 = R_z(heading) (a_2 + K_2 r_2)

with a the sensors' accelerations, r the way from sensor to joint (fixed in the sensor) and K what
turning adds (both in the sensor's own world). Heading and ways are found together, by robust least
squares; no body, mounting or pose is needed, only motion that accelerates sideways (walking,
turning, reaching).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import uniform_filter1d
from scipy.spatial.transform import Rotation, Slerp

from mocap_jax.recording import InertialStream

# Grid of the comparison [Hz]; above the cut-off, soft tissue shakes each sensor its own way.
_RATE_HZ, _CUTOFF_HZ = 50.0, 5.0
# Samples farther than this from a reading are not compared [s].
_GAP = 0.1
# Standard deviation of a difference at rest [m/s^2], and as a share of the acceleration around it:
# soft tissue and joints that are no points err in step with the motion.
_FLOOR, _SHARE, _AROUND = 0.1, 0.3, 1.0
# Such errors last [s]: so much of a recording is one observation.
_LASTING = 1.0
# From sensor to joint [m], per axis.
_REACH = 0.3
_ROUNDS = 6
# What the scatter of the residuals leaves unseen: errors in step with the motion look alike from
# stride to stride. A share of what the two accelerations differ by, and at least so much [rad] (on
# real recordings, headings found from walking and from running apart differ by 5 to 10 degrees).
_IN_STEP, _SYSTEMATIC = 0.3, np.deg2rad(5.0)
# Where they differ by more than they are, they have nothing in common: no heading is told.
_UNLIKE = 1.25
# Below this a recording tells no heading [rad].
_UNKNOWN = np.deg2rad(40.0)


@dataclass(frozen=True)
class JointHeading:
    """How one sensor's heading differs from its neighbour's."""

    angle: float
    """Turn about the vertical that brings the second sensor's orientations into the world of the
    first [rad]."""
    std: float
    """Standard deviation [rad]; pi where the motion tells nothing."""
    misfit: float
    """RMS difference of the joint's two accelerations [m/s^2]."""
    motion: float
    """RMS horizontal acceleration of the joint [m/s^2]."""
    lever_arms: Float[np.ndarray, "2 3"]
    """From each sensor to the joint, in the sensor's frame [m]."""

    @property
    def known(self) -> bool:
        """Whether the motion tells the heading at all."""
        return self.std < _UNKNOWN


class WorldMotion(NamedTuple):
    """One sensor on an even grid, in its own world, low-passed."""

    force: Float[np.ndarray, "t 3"]
    """Specific force [m/s^2]."""
    turning: Float[np.ndarray, "t 3 3"]
    """Times a way in the sensor's frame: the acceleration that turning adds [1/s^2]."""
    rate: Float[np.ndarray, "t 3"]
    """Angular velocity [rad/s]."""
    rotation: Float[np.ndarray, "t 3 3"]
    """`R_world_sensor`."""
    known: Bool[np.ndarray, "t"]


def even_grid(streams: list[InertialStream]) -> Float[np.ndarray, "t"]:
    """Times that all streams cover [s]; empty where they do not overlap."""
    times = [np.asarray(s.time, float) for s in streams]
    if not all(len(t) for t in times):
        return np.zeros(0)
    start, end = max(t[0] for t in times), min(t[-1] for t in times)
    return start + np.arange(max(int((end - start) * _RATE_HZ) + 1, 0)) / _RATE_HZ


def world_motion(stream: InertialStream, grid: Float[np.ndarray, "t"]) -> WorldMotion | None:
    """A sensor's motion; None without orientations and accelerations, or on too short a grid.

    Rates are those of the orientations, so that no gyroscope is needed.
    """
    force = np.asarray(stream.accelerometer, float)
    if not np.isfinite(force).all(axis=1).any():
        return None
    good = np.isfinite(force).all(axis=1) & np.isfinite(np.asarray(stream.orientation)).all(axis=1)
    return _on_grid(stream, grid, good, force)


def turning(stream: InertialStream, grid: Float[np.ndarray, "t"]) -> WorldMotion | None:
    """As `world_motion`, for sensors without accelerations too: those are zero."""
    good = np.isfinite(np.asarray(stream.orientation, float)).all(axis=1)
    return _on_grid(stream, grid, good, np.zeros((len(good), 3)))


def _on_grid(
    stream: InertialStream, grid: np.ndarray, good: np.ndarray, force: np.ndarray
) -> WorldMotion | None:
    time, quat = np.asarray(stream.time, float), np.asarray(stream.orientation, float)
    if good.sum() < 2 or len(grid) < 4 * _RATE_HZ / _CUTOFF_HZ:
        return None
    time, quat, force = time[good], quat[good], force[good]
    inside = np.clip(grid, time[0], time[-1])
    near = np.clip(np.searchsorted(time, inside), 1, len(time) - 1)
    away = np.minimum(np.abs(time[near] - grid), np.abs(time[near - 1] - grid))
    turn = Slerp(time, Rotation.from_quat(quat, scalar_first=True))(inside)
    world = Rotation.from_quat(quat, scalar_first=True).apply(force)
    f = np.stack([np.interp(inside, time, column) for column in world.T], axis=1)
    step = (turn[:-1].inv() * turn[1:]).as_rotvec() * _RATE_HZ
    rate = np.concatenate([step[:1], 0.5 * (step[:-1] + step[1:]), step[-1:]])  # sensor frame
    change = np.gradient(rate, 1 / _RATE_HZ, axis=0)
    R = turn.as_matrix()
    K = R @ (_skew(change) + _skew(rate) @ _skew(rate))
    return WorldMotion(_smooth(f), _smooth(K), _smooth(turn.apply(rate)), R, away < _GAP)


def joint_heading(first: WorldMotion, second: WorldMotion) -> JointHeading:
    """Heading of the second sensor relative to the first, and the joint's place."""
    known = first.known & second.known
    if not known.any():
        return JointHeading(0.0, np.pi, np.nan, 0.0, np.zeros((2, 3)))
    a, A, b, B = (x[known] for x in (first.force, first.turning, second.force, second.turning))
    level = np.concatenate([a[:, :2], b[:, :2]], axis=1)
    width = int(_AROUND * _RATE_HZ)
    around = np.sqrt(uniform_filter1d((level**2).sum(1) / 2, width, mode="nearest"))
    sigma = np.hypot(_FLOOR, _SHARE * around)
    fit = _Fit(a, A, b, B)
    weight, angle = sigma**-2, 0.0
    for k in range(_ROUNDS):
        angle, ways = fit.best(weight, angle if k else None)
        size = np.linalg.norm(fit.residual(angle, ways), axis=1) / sigma
        weight = sigma**-2 / np.maximum(1.0, size / 2.0)  # Huber
    left = fit.residual(angle, ways)
    share = np.sqrt((weight * (left**2).sum(1)).sum() / (weight * around**2).sum())
    std = np.hypot(fit.deviation(angle, ways, weight), np.hypot(_SYSTEMATIC, _IN_STEP * share))
    std = std if share < _UNLIKE else np.pi
    return JointHeading(
        float(np.mod(angle + np.pi, 2 * np.pi) - np.pi),
        float(min(std, np.pi)),
        float(np.sqrt((left**2).sum(1).mean())),
        float(np.sqrt((a[:, :2] ** 2).sum(1).mean())),
        ways.reshape(2, 3),
    )


class _Fit:
    """Weighted least squares over the two ways, at any heading."""

    def __init__(self, a: np.ndarray, A: np.ndarray, b: np.ndarray, B: np.ndarray) -> None:
        self.a, self.A, self.b, self.B = a, A, b, B

    def best(self, weight: np.ndarray, near: float | None) -> tuple[float, np.ndarray]:
        """Heading and ways of the smallest cost; searched everywhere, or near one."""
        span = np.pi if near is None else np.deg2rad(10.0)
        centre, grams = near or 0.0, self._grams(weight)
        while span > 1e-5:
            angles = centre + span * np.linspace(-1, 1, 73)
            costs, ways = self._solve(angles, grams)
            best = int(np.argmin(costs))
            centre, span = float(angles[best]), span / 18
        return centre, ways[best]

    def _grams(self, weight: np.ndarray) -> tuple[np.ndarray, ...]:
        """Sums over frames; what the heading multiplies is kept in three parts."""
        w = weight[:, None, None]
        first = np.concatenate([self.A, self.a[..., None]], axis=2)  # (t, 3, 4)
        second = np.concatenate([self.B, self.b[..., None]], axis=2)
        own = (first * w).swapaxes(1, 2) @ first, (second * w).swapaxes(1, 2) @ second
        cross = (first * w).reshape(-1, 12).T @ second.reshape(-1, 12)
        cross = cross.reshape(3, 4, 3, 4).transpose(0, 2, 1, 3)
        return own[0].sum(0), own[1].sum(0), cross

    def _solve(
        self, angles: np.ndarray, grams: tuple[np.ndarray, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Costs (n,) and best ways (n, 6) at some headings."""
        first, second, cross = grams
        between = np.einsum("nij,ijkl->nkl", _about_up(angles), cross)
        # Difference of accelerations: A r1 - Z B r2 + (a - Z b); unknown are the ways.
        normal, right = np.zeros((len(angles), 6, 6)), np.zeros((len(angles), 6))
        normal[:, :3, :3], normal[:, 3:, 3:] = first[:3, :3], second[:3, :3]
        normal[:, :3, 3:] = -between[:, :3, :3]
        normal[:, 3:, :3] = -between[:, :3, :3].swapaxes(1, 2)
        normal += np.eye(6) * _RATE_HZ * _LASTING / _REACH**2
        right[:, :3] = first[:3, 3] - between[:, :3, 3]
        right[:, 3:] = second[:3, 3] - between[:, 3, :3]
        ways = -np.linalg.solve(normal, right[..., None])[..., 0]
        forces = first[3, 3] + second[3, 3] - 2 * between[:, 3, 3]
        return forces + (right * ways).sum(1), ways

    def residual(self, angle: float, ways: np.ndarray) -> Float[np.ndarray, "t 3"]:
        """Difference of the joint's two accelerations [m/s^2]."""
        Z = _about_up(angle)
        return self.a + self.A @ ways[:3] - (self.b + self.B @ ways[3:]) @ Z.T

    def deviation(self, angle: float, ways: np.ndarray, weight: np.ndarray) -> float:
        """Of the heading, from the scatter of gradients between stretches of the recording."""
        Z = _about_up(angle)
        turned = (self.b + self.B @ ways[3:]) @ Z.T
        by_angle = -np.stack([-turned[:, 1], turned[:, 0], np.zeros(len(turned))], axis=1)
        J = np.concatenate([self.A, -Z @ self.B, by_angle[..., None]], axis=2)  # (t, 3, 7)
        JtW = J.swapaxes(1, 2) * weight[:, None, None]
        normal = (JtW @ J).sum(0)
        normal[np.arange(6), np.arange(6)] += _RATE_HZ * _LASTING / _REACH**2
        gradient = (JtW @ self.residual(angle, ways)[..., None])[..., 0]
        block = np.arange(len(gradient)) // int(_RATE_HZ * _LASTING)
        sums = np.stack([np.bincount(block, g) for g in gradient.T], axis=1)
        # Few stretches scatter by chance too little; a standard deviation is never below what
        # residuals of the expected size make.
        expected = normal * _RATE_HZ * _LASTING
        inverse = np.linalg.inv(normal)
        scatter = inverse @ (sums.T @ sums) @ inverse
        return float(np.sqrt(max(scatter[6, 6], (inverse @ expected @ inverse)[6, 6])))


def _about_up(angle: float | np.ndarray) -> np.ndarray:
    """One rotation matrix, or as many as there are angles."""
    angle = np.asarray(angle)
    return Rotation.from_rotvec(angle[..., None] * np.array([0.0, 0.0, 1.0])).as_matrix()


def _skew(v: Float[np.ndarray, "t 3"]) -> Float[np.ndarray, "t 3 3"]:
    x, y, z = v.T
    o = np.zeros_like(x)
    return np.stack([o, -z, y, z, o, -x, -y, x, o], axis=1).reshape(-1, 3, 3)


def _smooth(values: np.ndarray) -> np.ndarray:
    from scipy.signal import butter, sosfiltfilt  # slow to import

    sections = butter(2, _CUTOFF_HZ, output="sos", fs=_RATE_HZ)
    return sosfiltfilt(sections, values, axis=0)

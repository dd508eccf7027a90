"""`PoseSpline`: a smooth motion with exact velocities and accelerations at any time."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.interpolate import make_interp_spline

from mocap_jax.body import Topology
from mocap_jax.simulation.smoothing import unwrap


class PoseSpline:
    """Quintic (four times differentiable) spline through poses, evaluated on the manifold.

    Quaternion components c(t) are splined and normalised, q = c / |c|. Body-frame rates follow
    analytically: with n = |c|^2, w = 2 vec(c* c') / n and w' = 2 vec(c* c'') / n - w n' / n,
    because vec(c'* c') = 0. Velocities and accelerations are in MuJoCo's tangent convention.
    """

    def __init__(
        self, topology: Topology, time: Float[np.ndarray, "t"], q: Float[np.ndarray, "t nq"]
    ) -> None:
        self.topology = topology
        self.start, self.end = float(time[0]), float(time[-1])
        self._position = make_interp_spline(time, unwrap(topology, q), k=5)
        self._velocity = self._position.derivative()
        self._acceleration = self._velocity.derivative()

    def pose(self, time: Float[np.ndarray, "t"]) -> Float[np.ndarray, "t nq"]:
        """Poses at the given times [s]."""
        q = self._position(time)
        in_q, _ = self.topology.quat_index
        if in_q.size:
            q[..., in_q] /= np.linalg.norm(q[..., in_q], axis=-1, keepdims=True)
        return q

    def evaluate(
        self, time: Float[np.ndarray, "t"]
    ) -> tuple[Float[np.ndarray, "t nq"], Float[np.ndarray, "t nv"], Float[np.ndarray, "t nv"]]:
        """Poses, velocities and accelerations at the given times [s]."""
        c, dc, ddc = self._position(time), self._velocity(time), self._acceleration(time)
        v = np.zeros((len(c), self.topology.nv))
        a = np.zeros_like(v)
        in_q, in_v = self.topology.scalar_index
        v[:, in_v], a[:, in_v] = dc[:, in_q], ddc[:, in_q]
        quat_q, quat_v = self.topology.quat_index
        if quat_q.size:
            unit, w, dw = _rotation_rates(c[:, quat_q], dc[:, quat_q], ddc[:, quat_q])
            c[:, quat_q], v[:, quat_v], a[:, quat_v] = unit, w, dw
        return c, v, a


def _rotation_rates(
    c: Float[np.ndarray, "t n 4"], dc: Float[np.ndarray, "t n 4"], ddc: Float[np.ndarray, "t n 4"]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit quaternion, body-frame angular velocity and acceleration of c / |c|."""
    n = (c * c).sum(axis=-1, keepdims=True)
    dn = 2.0 * (c * dc).sum(axis=-1, keepdims=True)
    w = 2.0 * _conjugate_product(c, dc) / n
    dw = 2.0 * _conjugate_product(c, ddc) / n - w * dn / n
    return c / np.sqrt(n), w, dw


def _conjugate_product(p: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Vector part of p* r (wxyz)."""
    return p[..., :1] * r[..., 1:] - r[..., :1] * p[..., 1:] - np.cross(p[..., 1:], r[..., 1:])

"""Pose, sensor mounting and offsets from a rest hold (Vlasic 2007, section 5.4).

At rest every accelerometer points up. A Gauss-Newton solve finds the pose near the declared one,
the mounting rotations near the nominal ones and the offsets near zero that explain the mean
readings best, each weighted by its prior. Only tilt shows: turns about the vertical keep their
prior, unless sensors measured their whole orientation.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body import Body, difference, frames, retract, site_jacobians, sites_on_frames
from mocap_jax.compilation_cache import COMPILER_OPTIONS
from mocap_jax.initialise.declared_pose import declared_pose
from mocap_jax.initialise.rest_options import RestOptions
from mocap_jax.initialise.rest_readings import RestReadings, rest_readings
from mocap_jax.initialise.still import Still, find_still
from mocap_jax.recording import NoiseFigures, Recording, in_gap

_ITERATIONS = 12


@dataclass(frozen=True)
class RestEstimate:
    """What the rest hold tells; arrays in the order of `sensors`."""

    q: Float[np.ndarray, "nq"]
    """Pose at rest."""
    covariance: Float[np.ndarray, "nv nv"]
    """Of the pose, in the tangent space at it."""
    mounting_rotation: Float[np.ndarray, "s 3"]
    """Correction of the sites' rotation, in the sensor frame [rad]: the sensor's rotation is the
    nominal one times Exp of this."""
    accelerometer_bias: Float[np.ndarray, "s 3"]
    """[m/s^2]"""
    gyroscope_bias: Float[np.ndarray, "s 3"]
    """[rad/s]"""
    mounting_sigma: float
    """Standard deviation of mounting rotations, as the readings show it [rad]."""
    mismatch: float
    """How far the readings are from declared pose and mounting, 0 to 1: as a share of what pose and
    mounting errors of the expected size make. 1 where that was not tested (no hold declared, or
    `RestOptions.adapt` off), 0 without boards."""
    accelerometer_bias_std: Float[np.ndarray, "s 3"]
    gyroscope_bias_std: Float[np.ndarray, "s 3"]
    mounting_std: Float[np.ndarray, "s 3"]
    sensors: tuple[str, ...]
    sites: tuple[int, ...]
    """Site of each sensor in the body."""
    still: Still
    remarks: tuple[str, ...] = ()

    def mounted(self, body: Body) -> Body:
        """The body with the corrected mounting of these sensors' sites."""
        sites = np.array(self.sites, int)
        turned = so3.quat_multiply(
            so3.quat_normalise(body.site_quat[sites]),
            so3.quat_exp(jnp.asarray(self.mounting_rotation)),
        )
        return body.replace(site_quat=body.site_quat.at[sites].set(turned))


def rest_pose(
    recording: Recording,
    body: Body,
    *,
    options: RestOptions = RestOptions(),  # noqa: B008  (frozen)
    use_root: bool = True,
) -> RestEstimate:
    """Estimate the pose at rest, the sensors' mounting rotations and their offsets.

    Args:
        recording: with a rest hold in its set-up; otherwise the stillest window at the start is
            used and the remarks say so.
        body: the nominal body; its sites carry the sensors.
        options: what to estimate, and the priors.
        use_root: use the measured root pose, if the recording has it.

    Raises:
        InputError: a sensor has no site, or the declared pose does not fit the body.
    """
    start = declared_rest(recording, body, options)
    still, sites = start.still, start.sites
    readings = rest_readings(recording, still, use_root)
    noise = recording.setup.noise
    solved = _Problem(body, sites, readings, noise, options, still).solve(start.q)
    gyro = readings.rate if still.still and options.gyroscope_bias else start.gyroscope_bias
    measured = np.isfinite(gyro) & still.still & options.gyroscope_bias
    gyro_std = noise.gyroscope / np.sqrt(readings.count)[:, None]
    return dataclasses.replace(
        start,
        **solved,  # type: ignore[arg-type]
        gyroscope_bias=np.where(measured, gyro, 0.0),
        gyroscope_bias_std=np.where(measured, gyro_std, start.gyroscope_bias_std),
        remarks=_remarks(recording, still),
    )


def declared_rest(recording: Recording, body: Body, options: RestOptions) -> RestEstimate:
    """What `rest_pose` starts from: the declared pose, and sensors as declared."""
    site_of = {s.name: s.site for s in recording.setup.sensors}
    sensors = tuple(recording.inertial)
    none = np.zeros((len(sensors), 3))
    return RestEstimate(
        q=declared_pose(recording.setup.rest, body),
        covariance=options.pose_sigma**2 * np.eye(body.nv),
        mounting_rotation=none,
        accelerometer_bias=none,
        gyroscope_bias=none,
        mounting_sigma=options.mounting_sigma,
        mismatch=1.0,
        accelerometer_bias_std=none + options.accelerometer_bias_sigma,
        gyroscope_bias_std=none + options.gyroscope_bias_sigma,
        mounting_std=none + options.mounting_sigma,
        sensors=sensors,
        sites=tuple(body.site_index(site_of.get(name, name)) for name in sensors),
        still=find_still(recording, options),
    )


def _remarks(recording: Recording, still: Still) -> tuple[str, ...]:
    span = f"{still.start:.2f}-{still.end:.2f} s"
    if still.declared and in_gap(recording, still.start, still.end):
        return (
            f"Nothing was measured in the declared rest hold ({span}): offsets and mounting keep "
            "their nominal values.",
        )
    if still.declared:
        return ()
    if still.still:
        return (
            f"No rest hold is declared: the stillest window at the start ({span}, "
            f"{still.rate:.3f} rad/s) stands in for it.",
        )
    return (
        f"No rest hold is declared and the start is not still ({span} has {still.rate:.2f} rad/s): "
        "offsets and mounting keep their nominal values.",
    )


@partial(jax.jit, static_argnames=("sites",), compiler_options=COMPILER_OPTIONS)
def _predict(body: Body, sites: tuple[int, ...], q: jax.Array) -> tuple[jax.Array, ...]:
    """Specific force, rotation and their pose Jacobians at rest, where only turning counts."""
    f = frames(body, q)
    at = np.array(sites, int)
    rotation, position = sites_on_frames(body, f)
    _, angular = site_jacobians(body, f, position, at)
    R = rotation[at]
    turn = so3.matmul3(jnp.swapaxes(R, 1, 2), jnp.swapaxes(angular, 1, 2))
    force = so3.matvec3(jnp.swapaxes(R, 1, 2), -body.gravity)
    return force, so3.matmul3(so3.skew(force), turn), R, turn


class _Problem:
    """Gauss-Newton over (pose, mounting rotations, accelerometer offsets)."""

    def __init__(
        self,
        body: Body,
        sites: tuple[int, ...],
        readings: RestReadings,
        noise: NoiseFigures,
        options: RestOptions,
        still: Still,
    ) -> None:
        self.body, self.sites, self.readings, self.noise = body, sites, readings, noise
        self.options, self.still = options, still
        spread = np.sqrt(noise.accelerometer**2 / readings.count + options.stillness_sigma**2)
        # A window that is not still tells tilt only as far as accelerations stay small.
        self.force_sigma = spread if still.still else np.full_like(spread, 2.0)

    def solve(self, declared: np.ndarray) -> dict[str, np.ndarray | float]:
        s, nv = len(self.sites), self.body.nv
        centre = self._with_root(declared)
        sigma = self._sigmas(1.0)
        # Without boards nothing speaks against the declared figures.
        mismatch = 1.0 if s else 0.0
        if self.options.adapt and self.still.declared and s:
            mismatch = self._mismatch(centre, sigma)
            sigma = self._sigmas(mismatch)
        q, extra = centre, np.zeros(6 * s)
        for _ in range(_ITERATIONS):
            normal, gradient = self._normal(centre, q, extra, sigma)
            step = -np.linalg.solve(normal, gradient)
            q = np.asarray(retract(self.body.topology, jnp.asarray(q), jnp.asarray(step[:nv])))
            extra = extra + step[nv:]
            if np.abs(step).max() < 1e-10:
                break
        covariance = np.linalg.inv(normal)
        std = np.sqrt(np.diag(covariance))[nv:].reshape(2, s, 3)
        return {
            "q": q,
            "covariance": covariance[:nv, :nv],
            "mounting_rotation": extra[: 3 * s].reshape(s, 3),
            "accelerometer_bias": extra[3 * s :].reshape(s, 3),
            "mounting_sigma": float(sigma[nv]) if s else 0.0,
            "mismatch": mismatch,
            "mounting_std": std[0],
            "accelerometer_bias_std": std[1],
        }

    def _with_root(self, q: np.ndarray) -> np.ndarray:
        there, turned = self._root_known()
        q = q.copy()
        if self.body.has_free_root and there:
            q[:3] = self.readings.root_position
        if self.body.has_free_root and turned:
            q[3:7] = self.readings.root_orientation
        return q

    def _root_known(self) -> tuple[bool, bool]:
        """Whether position and orientation of the root were measured."""
        r = self.readings
        return bool(np.isfinite(r.root_position).all()), bool(np.isfinite(r.root_orientation).all())

    def _sigmas(self, scale: float) -> np.ndarray:
        """Prior standard deviations of (pose, mounting, offset)."""
        o, s, nv = self.options, len(self.sites), self.body.nv
        pose_sigma = o.pose_sigma if self.still.declared else o.undeclared_pose_sigma
        pose = np.full(nv, pose_sigma * scale if o.pose else 1e-6)
        for j in self.body.topology.free_joints:
            first = self.body.topology.joint_dof[j]
            pose[first : first + 3] = o.root_position_sigma
        if self.body.has_free_root:
            there, turned = self._root_known()
            if there:
                pose[:3] = self.noise.root_position
            if turned:
                pose[3:6] = self.noise.root_orientation
        fixed = not self.still.still
        mounting = 1e-6 if fixed or not o.mounting else o.mounting_sigma * scale
        bias = 1e-6 if fixed or not o.accelerometer_bias else o.accelerometer_bias_sigma
        return np.concatenate([pose, np.full(3 * s, mounting), np.full(3 * s, bias)])

    def _mismatch(self, q: np.ndarray, sigma: np.ndarray) -> float:
        """Misalignment of the readings at the declared pose, as a fraction of the expected."""
        rows, residual, _ = self._force_rows(q, np.zeros(6 * len(self.sites)), noisy=False)
        bias = 6 * len(self.sites) // 2
        tilts = rows[:, :-bias] * sigma[:-bias]
        expected = (tilts**2).sum()
        floor = residual.size * self.options.stillness_sigma**2
        # Offsets alone may explain this much of it.
        found = max((residual**2).sum() - (sigma[-bias:] ** 2).sum(), floor)
        return float(np.clip(np.sqrt(found / max(expected, 1e-12)), 0.02, 1.0))

    def _force_rows(
        self, q: np.ndarray, extra: np.ndarray, noisy: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Jacobian and residual (predicted minus measured) of the readings, and the whitening."""
        s, nv = len(self.sites), self.body.nv
        force, J_q, R, J_turn = (
            np.asarray(x) for x in _predict(self.body, self.sites, jnp.asarray(q))
        )
        mounting, bias = extra[: 3 * s].reshape(s, 3), extra[3 * s :].reshape(s, 3)
        M = np.swapaxes(np.asarray(so3.exp(jnp.asarray(mounting))), 1, 2)
        force = np.einsum("sij,sj->si", M, force)
        rows = np.zeros((2, s, 3, nv + 6 * s))
        rows[0, :, :, :nv], rows[1, :, :, :nv] = M @ J_q, M @ J_turn
        for i in range(s):
            at = nv + 3 * i
            rows[0, i, :, at : at + 3] = np.asarray(so3.skew(jnp.asarray(force[i])))
            rows[1, i, :, at : at + 3] = np.eye(3)
            rows[0, i, :, at + 3 * s : at + 3 * s + 3] = np.eye(3)
        seen = np.isfinite(self.readings.force).all(axis=1)
        residual = np.where(seen[:, None], force + bias - self.readings.force, 0.0)
        weight = seen / (self.force_sigma if noisy else 1.0)
        turned, turn_weight = self._turn_residual(R @ np.swapaxes(M, 1, 2))
        both = np.concatenate([residual, turned])
        weights = np.concatenate([weight, turn_weight if noisy else 0 * turn_weight])
        rows = rows.reshape(2 * s, 3, nv + 6 * s) * weights[:, None, None]
        return rows.reshape(6 * s, nv + 6 * s), (both * weights[:, None]).reshape(-1), weights

    def _turn_residual(self, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotation from the measured orientation to the predicted one, sensor frame."""
        quat = self.readings.orientation
        seen = np.isfinite(quat).all(axis=1)
        quat = jnp.asarray(np.where(seen[:, None], quat, [1.0, 0.0, 0.0, 0.0]))
        measured = np.asarray(so3.quat_to_matrix(quat))
        turn = np.asarray(so3.log(jnp.asarray(np.swapaxes(measured, 1, 2) @ R)))
        return np.where(seen[:, None], turn, 0.0), seen / self.noise.orientation

    def _normal(
        self, centre: np.ndarray, q: np.ndarray, extra: np.ndarray, sigma: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        rows, residual, _ = self._force_rows(q, extra)
        away = difference(self.body.topology, jnp.asarray(centre), jnp.asarray(q))
        prior = np.concatenate([np.asarray(away), extra])
        weight = 1.0 / sigma**2
        return rows.T @ rows + np.diag(weight), rows.T @ residual + weight * prior

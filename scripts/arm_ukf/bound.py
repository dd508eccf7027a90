"""Cramer-Rao bounds of an arm's angles in its plane: of one pulse, and of a filter.

Of a planar arm whose mobile does not vibrate, at the scene's range noise; a bias-free estimator
cannot be better. The filter's is the covariance of a Kalman filter that is linear at the truth,
with the joint UKF's process.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mocap_jax.arm.track import JERK_DENSITY
from mocap_jax.simulation.arm import ArmScene
from mocap_jax.simulation.arm_movement import ArmMovement

_SECONDS = 20.0


def report() -> None:
    """Print both bounds for smallest flexions of 10 to 40 degrees."""
    print("standard deviations of shoulder and elbow [deg], RMS over the movement, Cramer-Rao:")
    for least in (10.0, 20.0, 30.0, 40.0):
        scene = ArmScene(movement=ArmMovement(elbow_deg=(least, 125.0)))
        H = jacobians(scene)
        print(f"  elbow from {least:g} deg: one pulse {_text(single(H, scene.noise))}, "
              f"filter {_text(filtered(H, scene))}")  # fmt: skip


def jacobians(scene: ArmScene) -> Float[np.ndarray, "t 4 2"]:
    """Slopes of the ranges by shoulder and elbow, along the scene's mean movement."""
    m, time = scene.movement, np.arange(0, _SECONDS, 1 / scene.rate_hz)
    bent = 0.5 - 0.5 * np.cos(2 * np.pi * time / m.period)
    angles = [low + bent * (high - low) for low, high in (m.shoulder_deg, m.elbow_deg)]
    anchors, shoulder = jnp.array(list(scene.anchors.values())), jnp.array(scene.shoulder)

    def ranges(x: jax.Array) -> jax.Array:
        first, second = x[0], x[0] + x[1]
        along = scene.upper_arm * jnp.cos(first) + scene.forearm * jnp.cos(second)
        up = scene.upper_arm * jnp.sin(first) + scene.forearm * jnp.sin(second)
        return jnp.linalg.norm(shoulder + jnp.stack([along, jnp.zeros(()), up]) - anchors, axis=1)

    return np.asarray(jax.vmap(jax.jacfwd(ranges))(jnp.deg2rad(jnp.array(angles).T)))


def single(H: Float[np.ndarray, "t 4 2"], sigma: float) -> Float[np.ndarray, "2"]:
    """Of one pulse [rad]."""
    P = sigma**2 * np.linalg.inv(np.swapaxes(H, 1, 2) @ H)
    return np.sqrt(np.diagonal(P, axis1=1, axis2=2).mean(0))


def filtered(H: Float[np.ndarray, "t 4 2"], scene: ArmScene) -> Float[np.ndarray, "2"]:
    """Of all pulses so far, by the process of the joint UKF, after two seconds [rad]."""
    step = 1 / scene.rate_hz
    F = np.kron([[1, step, step**2 / 2], [0, 1, step], [0, 0, 1]], np.eye(2))
    power = [[step**5 / 20, step**4 / 8, step**3 / 6], [step**4 / 8, step**3 / 3, step**2 / 2],
             [step**3 / 6, step**2 / 2, step]]  # fmt: skip
    Q, P, seen = JERK_DENSITY * np.kron(power, np.eye(2)), 0.01 * np.eye(6), []
    for h in H:
        P = F @ P @ F.T + Q
        J = np.concatenate([h, np.zeros((len(h), 4))], axis=1)
        gain = P @ J.T @ np.linalg.inv(J @ P @ J.T + scene.noise**2 * np.eye(len(h)))
        P = P - gain @ J @ P
        seen.append(np.diagonal(P)[:2])
    return np.sqrt(np.mean(seen[round(2 / step) :], axis=0))


def _text(sigma: Float[np.ndarray, "2"]) -> str:
    return " ".join(f"{x:.2f}" for x in np.rad2deg(sigma))

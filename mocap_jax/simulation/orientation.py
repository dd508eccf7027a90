"""Orientations as boards with a fusion filter of their own report them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from mocap_jax.simulation.profiles import Profile
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.rig import Rig, site_rotations
from mocap_jax.simulation.spline import PoseSpline


def sample_orientations(
    rig: Rig,
    spline: PoseSpline,
    boards: tuple[str, ...],
    time: Float[np.ndarray, "n"],
    profile: Profile,
    seed: int,
) -> tuple[dict[str, Float[np.ndarray, "n 4"]], dict[str, np.ndarray]]:
    """Orientation R_world_sensor (wxyz) of all boards at the given times.

    A fusion filter errs slowly: its inclination and its heading are first-order Gauss-Markov
    processes, to which white noise is added.

    Args:
        rig: the true body with its sensors.
        spline: motion of the rig's model.
        boards: names of the boards, in the rig's order.
        time: uniform [s].
        profile: what errs how much.
        seed: of the random streams.

    Returns:
        Orientations by board, and their true slow errors as rotation vectors in the world [rad],
        `orientation_error/<board>` of shape (n, 3).
    """
    exact = site_rotations(rig, spline, np.clip(time, spline.start, spline.end))
    orientations, parameters = {}, {}
    for i, board in enumerate(boards):
        slow = _slow_error(time, profile, stream(seed, f"orientation_error/{board}"))
        measured = Rotation.from_rotvec(slow) * Rotation.from_matrix(exact[:, i])
        if profile.white:
            noise = stream(seed, f"orientation_noise/{board}").standard_normal((len(time), 3))
            measured = measured * Rotation.from_rotvec(profile.stated.orientation * noise)
        orientations[board] = measured.as_quat(scalar_first=True)
        parameters[f"orientation_error/{board}"] = slow
    return orientations, parameters


def _slow_error(
    time: Float[np.ndarray, "n"], profile: Profile, rng: np.random.Generator
) -> Float[np.ndarray, "n 3"]:
    """Stationary from the first sample on, per axis of the world (Z is up)."""
    deviation = np.array([profile.orientation_tilt] * 2 + [profile.orientation_heading])
    kept = np.exp(-(time[1] - time[0]) / profile.orientation_time)
    drive = rng.standard_normal((len(time), 3))
    drive[1:] *= np.sqrt(1 - kept**2)
    return deviation * lfilter([1.0], [1.0, -kept], drive, axis=0)

"""Orientations as boards with a fusion filter of their own report them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.simulation.gauss_markov import gauss_markov
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
    deviation = np.array([profile.orientation_tilt] * 2 + [profile.orientation_heading])
    orientations, parameters = {}, {}
    for i, board in enumerate(boards):
        rng = stream(seed, f"orientation_error/{board}")
        slow = gauss_markov(time, deviation, profile.orientation_time, rng)
        measured = Rotation.from_rotvec(slow) * Rotation.from_matrix(exact[:, i])
        if profile.white:
            noise = stream(seed, f"orientation_noise/{board}").standard_normal((len(time), 3))
            measured = measured * Rotation.from_rotvec(profile.stated.orientation * noise)
        orientations[board] = measured.as_quat(scalar_first=True)
        parameters[f"orientation_error/{board}"] = slow
    return orientations, parameters

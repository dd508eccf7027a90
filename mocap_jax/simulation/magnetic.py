"""Readings of magnetometers in a field that is disturbed, by sensors that are magnetised."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax.recording import MagneticStream
from mocap_jax.simulation.gauss_markov import gauss_markov
from mocap_jax.simulation.profiles import Profile
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.rig import Rig, site_rotations
from mocap_jax.simulation.spline import PoseSpline

# Of the dipole at the equator [T] (IGRF-13, Alken et al. 2021, Earth Planets Space 73, 49: its
# first-degree coefficients for 2020 amount to 29.7 microtesla).
_EQUATOR = 2.97e-5


def earth_field(latitude: float) -> tuple[float, float, float]:
    """The earth's field in a world whose X axis points to magnetic north, Z up [T].

    That of a dipole: tan(inclination) = 2 tan(latitude), downwards in the north.

    Args:
        latitude: magnetic latitude [rad], negative in the south.
    """
    north, down = np.cos(latitude), 2 * np.sin(latitude)
    return float(_EQUATOR * north), 0.0, float(-_EQUATOR * down)


def sample_magnetic(
    rig: Rig,
    spline: PoseSpline,
    boards: tuple[str, ...],
    time: Float[np.ndarray, "n"],
    field: tuple[float, float, float],
    profile: Profile,
    seed: int,
) -> tuple[dict[str, MagneticStream], dict[str, np.ndarray]]:
    """What the magnetometers of all boards read.

    Args:
        rig: the true body with its sensors.
        spline: motion of the rig's model.
        boards: names of the boards, in the rig's order.
        time: uniform [s].
        field: undisturbed, in the world [T].
        profile: what errs how much.
        seed: of the random streams.

    Returns:
        Streams by board, and their true errors: `hard_iron/<board>` in the sensor frame (3,) and
        `magnetic_disturbance/<board>` in the world (n, 3) [T].
    """
    rotation = site_rotations(rig, spline, np.clip(time, spline.start, spline.end))
    streams, parameters = {}, {}
    for i, board in enumerate(boards):
        rng = stream(seed, f"magnetic/{board}")
        hard_iron = profile.magnetic_bias * rng.standard_normal(3)
        disturbance = gauss_markov(time, profile.magnetic_disturbance, profile.magnetic_time, rng)
        there = np.asarray(field) + disturbance
        reading = np.einsum("nji,nj->ni", rotation[:, i], there) + hard_iron
        if profile.white:
            reading += profile.stated.magnetometer * rng.standard_normal(reading.shape)
        streams[board] = MagneticStream(time, reading)
        parameters[f"hard_iron/{board}"] = hard_iron
        parameters[f"magnetic_disturbance/{board}"] = disturbance
    return streams, parameters

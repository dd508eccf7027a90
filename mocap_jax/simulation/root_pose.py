"""The externally measured pose of the root body."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.recording import RootStream
from mocap_jax.simulation.profiles import Profile
from mocap_jax.simulation.random_streams import stream


def sample_root(
    time: Float[np.ndarray, "n"], q: Float[np.ndarray, "n nq"], profile: Profile, seed: int
) -> RootStream:
    """Root poses with the profile's stated noise; the free joint is the first of q."""
    position, quat = q[:, :3], q[:, 3:7]
    if profile.white:
        rng = stream(seed, "root_noise")
        position = position + profile.stated.root_position * rng.standard_normal(position.shape)
        turn = profile.stated.root_orientation * rng.standard_normal((len(q), 3))
        turned = Rotation.from_quat(quat, scalar_first=True) * Rotation.from_rotvec(turn)
        quat = turned.as_quat(scalar_first=True)
    return RootStream(time, position, quat)

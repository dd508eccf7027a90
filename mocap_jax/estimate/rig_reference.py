"""Lever arms of the two-segment rig by its optical orientations: what arms are compared with.

The files' own arms (from rulers and markers) differ by up to a centimetre between trials of the
same sensors. With both orientations known, f_joint of the two sensors (see `initialise.joint`) is
linear in arms and accelerometer biases.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.initialise import JointOptions
from mocap_jax.initialise.joint.centre import lever
from mocap_jax.initialise.joint.readings import pair_of
from mocap_jax.io.two_segment_rig import SENSORS, RigTrial

_ROUNDS, _HUBER = 10, 2.0


def optical_arms(trial: RigTrial) -> Float[np.ndarray, "2 3"]:
    """Arms from both sensors to the joint [m] under the reference's orientations, robustly.

    Along a hinge's axis they are not determined either.
    """
    whole = JointOptions(window=float(np.ptp(trial.recording.inertial[SENSORS[0]].time)))
    pair = pair_of(trial.recording, *SENSORS, whole)
    count = pair.rate.shape[2]
    known = trial.known[:count] & pair.known[0]
    first, second = np.swapaxes(np.asarray(so3.quat_to_matrix(trial.reference[:count])), 0, 1)
    R = (np.swapaxes(first, 1, 2) @ second)[known]
    K, force = lever(pair.rate, pair.turn)[0][:, known], pair.force[0][:, known]
    eye = np.broadcast_to(np.eye(3), R.shape)
    A = np.concatenate([K[0], -R @ K[1], -eye, R], axis=-1)
    b = np.einsum("nij,nj->ni", R, force[1]) - force[0]
    weight = np.ones(len(R))
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)[:, None]
        flat = (A * root[..., None]).reshape(-1, A.shape[-1])
        x = np.linalg.lstsq(flat, (b * root).ravel(), rcond=None)[0]
        size = np.linalg.norm(A @ x - b, axis=1)
        weight = np.minimum(1.0, _HUBER * np.median(size) / np.maximum(size, 1e-9))
    return x[:6].reshape(2, 3)

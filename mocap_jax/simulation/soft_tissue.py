"""Soft tissue: boards wobble on and slide with the skin under them."""

from __future__ import annotations

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.signal import cont2discrete, lfilter
from scipy.spatial.transform import Rotation

from mocap_jax.simulation.profiles import Profile
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.rig import Rig, inertial_readings
from mocap_jax.simulation.spline import PoseSpline

# Skin gives along itself, hardly in depth.
_DEPTH_SHARE = 0.3
# Displacements beyond this stiffen [m] (skin is taut), and turn the board about this lever [m].
_TAUT = 0.012
_LEVER = 0.2


def wobble(
    fixed: Rig,
    spline: PoseSpline,
    time: Float[np.ndarray, "t"],
    boards: tuple[str, ...],
    profile: Profile,
    seed: int,
) -> Float[np.ndarray, "t boards 7"]:
    """Displacement [m] and turn (wxyz) of each board from its mounting, in the mounting's frame.

    A damped oscillator x'' + 2 z w x' + w^2 x = -(f - f_rest) is driven by the specific force f
    at the board (1 g moves a board of 8 Hz by 4 mm); sliding proportional to the rotation of the
    segment's joint since the rest pose is added.

    Args:
        fixed: rig with boards fixed to their segments.
        spline: motion of that rig.
        time: uniform knots; the body is at rest at the first.
        boards: names, in the rig's order.
        profile: frequency, damping, sliding.
        seed: of the random streams.
    """
    force = inertial_readings(fixed, spline, time)[:, :, :3]
    drive = force[0] - force
    omega = 2.0 * np.pi * profile.tissue_frequency
    transfer = ([1.0], [1.0, 2.0 * profile.tissue_damping * omega, omega**2])
    b, a, _ = cont2discrete(transfer, float(time[1] - time[0]), method="foh")
    shift = lfilter(np.ravel(b), a, drive, axis=0)
    turns = _joint_turns(fixed, spline, time)
    for i, board in enumerate(boards):
        gain = stream(seed, f"soft_tissue/{board}").standard_normal((3, 3))
        shift[:, i] += profile.tissue_slide * turns[:, i] @ gain.T
    shift = _TAUT * np.tanh(shift / _TAUT) * [1.0, 1.0, _DEPTH_SHARE]
    vector = np.stack([-shift[..., 1], shift[..., 0], np.zeros(shift.shape[:2])], axis=-1) / _LEVER
    turn = Rotation.from_rotvec(vector.reshape(-1, 3)).as_quat(scalar_first=True)
    return np.concatenate([shift, turn.reshape(*shift.shape[:2], 4)], axis=2)


def _joint_turns(rig: Rig, spline: PoseSpline, time: np.ndarray) -> Float[np.ndarray, "t boards 3"]:
    """Rotation vector of each board's segment in its parent since the first knot [rad]."""
    model, data = rig.model, rig.data
    bodies = model.site_bodyid[rig.board_sites]
    parents = model.body_parentid[bodies]
    own, above = np.empty((len(time), len(bodies), 4)), np.empty((len(time), len(bodies), 4))
    for i, q in enumerate(spline.pose(time)):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        own[i], above[i] = data.xquat[bodies], data.xquat[parents]
    out = np.zeros((len(time), len(bodies), 3))
    for b in np.flatnonzero(parents > 0):
        relative = Rotation.from_quat(above[:, b], scalar_first=True).inv() * Rotation.from_quat(
            own[:, b], scalar_first=True
        )
        vector = (relative[0].inv() * relative).as_rotvec()
        # Keep the branch continuous past half turns.
        length = np.linalg.norm(vector, axis=1, keepdims=True)
        out[:, b] = np.where(length > 0, vector / np.maximum(length, 1e-12) * np.sin(length), 0.0)
    return out

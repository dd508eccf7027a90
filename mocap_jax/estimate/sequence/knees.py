"""Knees are hinges, also in bodies that have ball joints there.

Skeletons of motion files and of body models often give every joint three rotations. A real knee
leaves its flexion axis by a few degrees (Lafortune et al. 1992, J. Biomech. 25, 347-357). Without
that knowledge the mounting of a board on the shank, and the whole leg below the knee, can turn
about the leg's axis and sideways with nothing to hold it but the declared rest pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.body.topology import BALL
from mocap_jax.estimate.sequence.user_residuals import KNEES, UserResidual
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.residuals.hinge import hinge_residual
from mocap_jax.solution.anatomy import anatomical_frames

# Flexion is the rotation about the third axis, Z, of the anatomical frame (`solution.anatomy`).
_FLEXION = 2


@dataclass(frozen=True)
class _Hinges:
    """`UserResidual.function`: whitened rotation of ball joints about other axes than a hinge's."""

    places: tuple[int, ...]
    """Where the joints' quaternions begin in q."""

    def __call__(self, body: Body, q: Float[Array, "1 nq"], data: Any) -> Float[Array, "m"]:
        at = np.array(self.places)[:, None] + np.arange(4)
        residual = hinge_residual(q[0][at], jnp.asarray(body.qpos0)[at], data["axis"])
        return (data["root_information"] * residual).ravel()


def knee_hinges(
    body: Body, frames: int, options: OptimiseOptions
) -> tuple[tuple[UserResidual, ...], tuple]:
    """The residual of ball-joint knees and its data; empty where a body has none.

    The deviation from a hinge repeats with the motion, so that `independent_samples` frames of it
    count as one observation, as do all frames of a shorter recording.

    Args:
        body: the body; knees are found by the names of the segments of the legs.
        frames: of the recording.
        options: `prior.knee_sigma` and `noise.independent_samples`.
    """
    sigma, topology = options.prior.knee_sigma, body.topology
    joints = [j for j in range(topology.njoint) if _is_ball_knee(body, j)] if sigma > 0 else []
    if not joints:
        return (), ()
    segments = [topology.joint_body[j] for j in joints]
    axis = anatomical_frames(body)[segments][:, :, _FLEXION]
    count = min(float(frames), options.noise.independent_samples)
    data = {
        "axis": np.tile(axis, (frames, 1, 1)),
        "root_information": np.full(frames, 1 / (sigma * np.sqrt(count))),
    }
    places = tuple(int(topology.joint_qpos[j]) for j in joints)
    return (UserResidual(KNEES, _Hinges(places)),), (data,)


def _is_ball_knee(body: Body, joint: int) -> bool:
    """A ball joint that alone joins a shank to a thigh, with a foot that tells the shank's axis."""
    topology = body.topology
    segment = topology.joint_body[joint]
    name, names = topology.body_names[segment], topology.body_names
    side = name.removesuffix("LowerLeg")
    return (
        side in ("Left", "Right")
        and name != side
        and topology.joint_types[joint] == BALL
        and len(topology.joints_of_body(segment)) == 1
        and {f"{side}UpperLeg", f"{side}Foot"} <= set(names)
    )

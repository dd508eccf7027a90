"""Axes that `find_joint` has found, as a residual: hinges have play, and axes are not exact."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body import Body, site_frames
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.estimate.sequence.user_residuals import UserResidual
from mocap_jax.initialise import JointFinding
from mocap_jax.residuals.joint_axes import one_axis_residual, two_axes_residual

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class _Axes:
    """`UserResidual.function`: whitened distance of two sensors' orientations from a joint's."""

    sites: tuple[int, int]
    first: Vector
    second: Vector
    cosine: float | None
    """Of the angle between the two axes; None for a hinge."""

    def __call__(
        self, body: Body, q: Float[Array, "1 nq"], data: dict[str, Array]
    ) -> Float[Array, "m"]:
        first, second = site_frames(body, q[0]).rotation[np.array(self.sites)]
        R_first_second = so3.matmul3(first.T, second)
        axes = jnp.array(self.first), jnp.array(self.second)
        if self.cosine is None:
            off = one_axis_residual(R_first_second, *axes)
        else:
            off = two_axes_residual(R_first_second, *axes, self.cosine)[None]
        return off * data["whitening"]


def joint_axes(
    finding: JointFinding,
    body: Body,
    time: Float[np.ndarray, "t"],
    *,
    sigma: float = 0.0175,
    correlation_time: float = 1.0,
) -> tuple[UserResidual, dict[str, np.ndarray]]:
    """A residual for `OptimiseOptions.user_residuals`, and its data for `optimise`.

    It keeps a ball joint near the hinge or universal joint that was found.

    Args:
        finding: of a hinge or a universal joint.
        body: whose sites have the two sensors' names and orientations (`joint_recording`).
        time: of the frames, `gather(recording, body).time` [s].
        sigma: standard deviation of an axis' direction [rad]: play, and the finding's own error.
        correlation_time: how long such an error lasts [s]; frames within it count as one.

    Returns:
        The residual "joint_axes" and its rows.

    Raises:
        InputError: a ball joint has no axes; no such sites; figures not above zero.
    """
    if finding.first_axis is None or finding.second_axis is None:
        raise InputError("joint axes: a ball joint was found, which has none")
    if not (sigma > 0 and correlation_time > 0):
        raise InputError("joint axes: sigma and correlation_time must be above 0")
    names = body.topology.site_names
    for sensor in finding.sensors:
        if sensor not in names:
            raise unknown_name("site of a sensor", sensor, names)
    cosine = None
    if finding.kind == "universal":
        R = np.asarray(so3.quat_to_matrix(finding.relative))
        cosine = float(np.mean(R @ finding.second_axis @ finding.first_axis))
    function = _Axes(
        (names.index(finding.sensors[0]), names.index(finding.sensors[1])),
        _vector(finding.first_axis), _vector(finding.second_axis), cosine,
    )  # fmt: skip
    time = np.asarray(time)
    share = min(1.0, float(time[1] - time[0]) / correlation_time)
    rows = {"whitening": np.full(len(time), np.sqrt(share) / sigma)}
    return UserResidual("joint_axes", function, 1), rows


def _vector(axis: Float[np.ndarray, "3"]) -> Vector:
    x, y, z = (float(v) for v in axis)
    return x, y, z

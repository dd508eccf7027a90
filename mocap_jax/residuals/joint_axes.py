"""How far a joint's orientation is from what its axes allow."""

from __future__ import annotations

from jax import Array
from jaxtyping import Float

from mocap_jax import so3


def one_axis_residual(
    R_first_second: Float[Array, "*b 3 3"],
    first: Float[Array, "*b 3"],
    second: Float[Array, "*b 3"],
) -> Float[Array, "*b 3"]:
    """Distance of a hinge's axis as either side has it, in the first's frame [rad, small angles].

    Args:
        R_first_second: orientation of the second side in the first's frame.
        first: unit vector of the axis in the first side's frame.
        second: the same axis in the second's.
    """
    return first - so3.matvec3(R_first_second, second)


def two_axes_residual(
    R_first_second: Float[Array, "*b 3 3"],
    first: Float[Array, "*b 3"],
    second: Float[Array, "*b 3"],
    cosine: Float[Array, "*b"] | float,
) -> Float[Array, "*b"]:
    """How far the angle between a universal joint's two axes is from its constant value.

    The difference of the cosines: the angle's error [rad] where the axes are about at right angles.

    Args:
        R_first_second: orientation of the second side in the first's frame.
        first: unit vector of the axis that is fixed in the first side.
        second: unit vector of the axis that is fixed in the second.
        cosine: of the angle between them.
    """
    return (first * so3.matvec3(R_first_second, second)).sum(axis=-1) - cosine

"""Accelerations turned into the world by measured orientations (von Marcard 2017, eq. 13 to 16).

Each is a constant of its residual then, which depends on positions alone: neither does gravity tell
tilt, nor can a wrong tilt make up for acceleration. What measured orientations err by is an error
of acceleration instead, 0.17 m/s^2 a degree of tilt.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.measurement import FrameData

_CHOICES = ("model", "measured")


def uses_measured_rotation(data: FrameData, options: OptimiseOptions) -> bool:
    """Whether measured orientations turn accelerations.

    Raises:
        InputError: no such choice, no measured orientations, or an unknown that would turn them.
    """
    if options.acceleration_rotation not in _CHOICES:
        raise unknown_name("acceleration_rotation", options.acceleration_rotation, _CHOICES)
    if options.acceleration_rotation == "model":
        return False
    if not _known(data).any():
        raise InputError(
            "acceleration_rotation 'measured': no orientations are used (kinds "
            f"'{options.kinds}'); valid: kinds with O and a recording that holds them, or 'model'"
        )
    for name in ("heading_sigma", "clock_offset_sigma"):
        if getattr(options.constants, name):
            raise InputError(
                f"acceleration_rotation 'measured': {name} makes measured orientations unknown; "
                f"valid: constants.{name} 0, or 'model'"
            )
    return True


def where_turned(
    variance: Float[np.ndarray, "t s"], data: FrameData, force_weights: tuple[float, float, float]
) -> Float[np.ndarray, "t s"]:
    """Variances of accelerations, infinite without a measured orientation in their stencil.

    Args:
        variance: of each frame's acceleration [m^2/s^4].
        data: measurements on the frame grid.
        force_weights: of the stencil's frames.
    """
    known = _known(data)
    use = [w != 0 for w in force_weights]
    there = known.copy()
    there[1:-1] = np.all(
        [~np.array(u) | known[j : len(known) - 2 + j] for j, u in enumerate(use)], 0
    )
    return np.where(there, variance, np.inf)


def _known(data: FrameData) -> Bool[np.ndarray, "t s"]:
    return np.isfinite(np.asarray(data.orientation)).all(-1)

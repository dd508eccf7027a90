"""Accelerations turned into the world by measured orientations (von Marcard 2017, eq. 13 to 16).

Each is a constant of its residual then, which depends on positions alone: neither does gravity tell
tilt, nor can a wrong tilt make up for acceleration. What measured orientations err by is an error
of acceleration instead, 0.17 m/s^2 a degree of tilt.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.estimate.sequence.terms import Built
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.measurement import FrameData

_CHOICES = ("model", "measured")


def with_measured_rotation(built: Built, data: FrameData, options: OptimiseOptions) -> Built:
    """The problem with the rotation that the options name.

    Accelerations without a measured orientation in their stencil are left out.

    Raises:
        InputError: no measured orientations, or an unknown that would turn them.
    """
    if options.acceleration_rotation == "model":
        return built
    if options.acceleration_rotation not in _CHOICES:
        raise unknown_name("acceleration_rotation", options.acceleration_rotation, _CHOICES)
    known = np.isfinite(np.asarray(data.orientation)).all(-1)
    if not known.any():
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
    declared, model = built.variances["accelerometer"]
    use = [w != 0 for w in built.layout.force_weights]
    there = known.copy()
    there[1:-1] = np.all(
        [~np.array(u) | known[j : len(known) - 2 + j] for j, u in enumerate(use)], 0
    )
    variances = built.variances | {"accelerometer": (np.where(there, declared, np.inf), model)}
    layout = dataclasses.replace(built.layout, measured_rotation=True)
    return dataclasses.replace(built, layout=layout, variances=variances)

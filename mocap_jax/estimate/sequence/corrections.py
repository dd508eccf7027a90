"""Which further errors of boards are unknowns of a problem, and the arrays they need."""

from __future__ import annotations

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.estimate.sequence.slopes import slopes
from mocap_jax.estimate.sequence.walk import Walk, number_of_steps, walk
from mocap_jax.estimate.whole_sequence_options import ConstantsOptions
from mocap_jax.measurement import FrameData
from mocap_jax.recording import NoiseFigures
from mocap_jax.residuals.inertial import mean_rate


def correction_fields(data: FrameData, options: ConstantsOptions) -> dict[str, int]:
    """Fields of `Layout`: what the options ask for and the measurements can show at all.

    Raises:
        InputError: a negative deviation, or an interval of walks that is too short.
    """
    for name in _SIGMAS:
        if not getattr(options, name) >= 0:
            raise InputError(f"{name} {getattr(options, name):g}: must be 0 (off) or more")
    force, rate, orientation = (
        bool(np.isfinite(np.asarray(x)).any())
        for x in (data.accelerometer, data.gyroscope, data.orientation)
    )
    walks = {
        "gyroscope_steps": rate and options.gyroscope_walk_sigma > 0,
        "accelerometer_steps": force and options.accelerometer_walk_sigma > 0,
    }
    time = np.asarray(data.time)
    steps = number_of_steps(
        options.bias_interval, float(time[-1] - time[0]), 3 * len(data.sites) * sum(walks.values())
    )
    return {
        "use_accelerometer_scale": force and options.accelerometer_scale_sigma > 0,
        "use_gyroscope_scale": rate and options.gyroscope_scale_sigma > 0,
        "use_clock_offset": (force or rate or orientation) and options.clock_offset_sigma > 0,
        "use_heading": orientation and options.heading_sigma > 0,
        **{name: steps * used for name, used in walks.items()},
    }


_SIGMAS = (
    "accelerometer_scale_sigma", "gyroscope_scale_sigma", "clock_offset_sigma", "heading_sigma",
    "gyroscope_walk_sigma", "accelerometer_walk_sigma",
)  # fmt: skip


def slope_terms(
    force: np.ndarray, rate: np.ndarray, step: float, noise: NoiseFigures
) -> dict[str, tuple]:
    """Fields of `Terms` for unknown clock offsets.

    Args:
        force: de-averaged specific forces (t, s, 3), NaN where missing.
        rate: de-averaged rates likewise.
        step: between frames [s].
        noise: declared.
    """
    turning = slopes(rate, step, noise.gyroscope)
    return {
        "force_slopes": slopes(force, step, noise.accelerometer),
        "rate_slopes": turning,
        "mean_rate_slopes": tuple(np.nan_to_num(mean_rate(x)) for x in turning),
    }


def walk_of(data: FrameData, gyroscope_steps: int, accelerometer_steps: int) -> Walk | None:
    """The walk that both kinds of biases share; None where biases stay."""
    steps = max(gyroscope_steps, accelerometer_steps)
    return walk(np.asarray(data.time), steps) if steps else None

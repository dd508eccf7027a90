"""Motions of different frame rates brought to the lowest of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.motion import Motion
from mocap_jax.simulation.options import SimulationOptions
from mocap_jax.simulation.smoothing import bridge_jumps, low_pass
from mocap_jax.simulation.spline import PoseSpline
from mocap_jax.trajectory import Trajectory

_LEAST_FRAMES = 8
"""That the spline and the low-pass need."""
_SAME = 1.0001
"""Rates of a smaller ratio differ by rounding."""
_CUTOFF = 0.4
"""Low-pass before frames are left out, as a share of the new rate: what is above half of it would
come back as something slower."""


def frame_rate(motion: Motion) -> float:
    """Frames a second of a motion of at least two frames [Hz]."""
    time = np.asarray(motion.trajectory.time)
    return (len(time) - 1) / float(time[-1] - time[0])


def same_rate(
    motions: Mapping[str, Motion], fastest_joint: float = SimulationOptions.fastest_joint
) -> dict[str, Motion]:
    """Motions at the lowest frame rate of all; those that have it already are as they were.

    Faster ones are low-passed at 0.4 times that rate and taken from a quintic spline; their fact
    `resampled_from_hz` tells it. Tracking errors are bridged before (`bridge_jumps`): smoothed and
    spread over longer frames they would pass for motion.

    Args:
        motions: by names; one of a single frame, which has no rate, stays as it is.
        fastest_joint: see `SimulationOptions` [rad/s].

    Raises:
        InputError: a clip of fewer than 8 frames would have to be resampled.
    """
    rates = {name: frame_rate(m) for name, m in motions.items() if len(m.trajectory.time) > 1}
    lowest = min(rates.values(), default=0.0)
    fast = [name for name, rate in rates.items() if rate > _SAME * lowest]
    return {
        name: _at_rate(m, lowest, fastest_joint) if name in fast else m
        for name, m in motions.items()
    }


def _at_rate(motion: Motion, rate: float, fastest_joint: float) -> Motion:
    """A motion at a lower frame rate [Hz]; its time starts at zero."""
    path, own = motion.trajectory, frame_rate(motion)
    count = len(path.time)
    if count < _LEAST_FRAMES:
        raise InputError(
            f"motion '{motion.name}': {count} frames; at least {_LEAST_FRAMES} are needed to bring "
            f"it from {own:.6g} to {rate:.6g} Hz"
        )
    topology = motion.body.topology
    q, bridged = bridge_jumps(topology, np.asarray(path.q), own, fastest_joint)
    q, _ = low_pass(topology, q, own, _CUTOFF * rate)
    spline = PoseSpline(topology, np.arange(count) / own, q)
    # Rounding must not take the last frame away.
    time = np.arange(int((count - 1) / own * rate + 1e-6) + 1) / rate
    poses = spline.pose(np.minimum(time, spline.end))
    facts = {**motion.facts, "resampled_from_hz": own}
    if bridged:
        facts["bridged_frames"] = bridged
    trajectory = Trajectory(jnp.asarray(time), jnp.asarray(poses))
    return replace(motion, trajectory=trajectory, facts=facts)

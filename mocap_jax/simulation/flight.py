"""Sound between moving bodies: when it arrives, and what stands in its way."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import BSpline, make_interp_spline

from mocap_jax.simulation.rig import Rig, place
from mocap_jax.simulation.spline import PoseSpline

# Microphone paths are splined through poses at this rate [Hz]; with content below 20 Hz the
# quintic spline between them errs by less than a micrometre.
_PATH_RATE = 500.0
_FIXED_POINT_STEPS = 6
# Rays start and end this far off the skin along the device's axis [m], so that the shape a
# device sits on (or a centimetre inside of, when worn carelessly) does not shadow it.
_RAY_CLEARANCE = 0.02


@dataclass(frozen=True)
class Flights:
    """Direct paths of n pulses to r microphones."""

    time: Float[np.ndarray, "n"]
    """Of emission [s]."""
    source: np.ndarray
    """Index of the source of each pulse, shape (n,)."""
    distance: Float[np.ndarray, "n r"]
    """From the source at emission to the microphone at arrival [m]."""
    cosine: Float[np.ndarray, "n r"]
    """Of the angle between the emission axis and the way to the microphone."""
    occluded: Bool[np.ndarray, "n r"]
    """The body stands in the way."""


@dataclass(frozen=True)
class Emissions:
    """Where the devices are, for n pulses and r microphones."""

    origin: Float[np.ndarray, "n 3"]
    """Of each pulse [m]."""
    axis: Float[np.ndarray, "n 3"]
    """Its emission axis."""
    way: Float[np.ndarray, "n r 3"]
    """From the origin to each microphone at the arrival of the direct sound [m]."""
    outward: Float[np.ndarray, "n r 3"]
    """Axis of each microphone at the emission."""


def fly(
    rig: Rig,
    spline: PoseSpline,
    *,
    end: float,
    pulse_interval: float,
    speed_of_sound: float,
    frequencies: tuple[float, ...] = (),
) -> Flights:
    """Trace every pulse of a round robin over the sources to all microphones (see `trace`)."""
    return trace(
        rig, spline, end=end, pulse_interval=pulse_interval, speed_of_sound=speed_of_sound,
        frequencies=frequencies,
    )[0]  # fmt: skip


def trace(
    rig: Rig,
    spline: PoseSpline,
    *,
    end: float,
    pulse_interval: float,
    speed_of_sound: float,
    frequencies: tuple[float, ...] = (),
) -> tuple[Flights, Emissions]:
    """Direct paths of every pulse of a round robin over the sources, and where devices are.

    The flight time solves |p_mic(t + tau) - p_source(t)| = c tau by fixed-point iteration, which
    contracts by the ratio of the microphone's speed to that of sound, below 0.05 a step.

    Args:
        rig: the true body with its devices.
        spline: its motion.
        end: time of the last pulse at the latest [s].
        pulse_interval: time between pulses of successive sources [s].
        speed_of_sound: the true one [m/s].
        frequencies: of the sources [Hz]; each has a round robin of its own. Default: one for all.
    """
    count = int(np.floor(end / pulse_interval)) + 1
    slot, source = _round_robins(count, frequencies or (0.0,) * len(rig.source_sites))
    time = pulse_interval * slot
    origin, axis, outward, occluded = _emissions(rig, spline.pose(time), source)
    path = _microphone_paths(rig, spline)
    flight = np.zeros((len(slot), len(rig.microphone_sites)))
    for _ in range(_FIXED_POINT_STEPS):
        way = _at_arrival(path, np.minimum(time[:, None] + flight, spline.end)) - origin[:, None]
        distance = np.linalg.norm(way, axis=2)
        flight = distance / speed_of_sound
    cosine = (way * axis[:, None]).sum(axis=2) / np.maximum(distance, 1e-9)
    flights = Flights(time, source, distance, cosine, occluded)
    return flights, Emissions(origin, axis, way, outward)


def _round_robins(count: int, frequencies: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Slot and source of every pulse in `count` slots, in order."""
    slot = np.arange(count)
    turns = [
        np.flatnonzero(np.array(frequencies) == f)[slot % frequencies.count(f)]
        for f in dict.fromkeys(frequencies)
    ]
    return np.repeat(slot, len(turns)), np.stack(turns, axis=1).ravel()


def _microphone_paths(rig: Rig, spline: PoseSpline) -> BSpline:
    """Spline of the positions of all microphones, shape (t, r, 3)."""
    count = int(np.ceil((spline.end - spline.start) * _PATH_RATE)) + 1
    time = np.linspace(spline.start, spline.end, max(count, 8))
    positions = np.empty((len(time), len(rig.microphone_sites), 3))
    for i, q in enumerate(spline.pose(time)):
        place(rig, q)
        positions[i] = rig.data.site_xpos[rig.microphone_sites]
    return make_interp_spline(time, positions, k=5)


def _at_arrival(path: BSpline, time: Float[np.ndarray, "n r"]) -> Float[np.ndarray, "n r 3"]:
    """Position of each microphone at its own times."""
    out = np.empty((*time.shape, 3))
    for r in range(time.shape[1]):
        out[:, r] = BSpline(path.t, path.c[:, r], path.k)(time[:, r])
    return out


def _emissions(
    rig: Rig, poses: Float[np.ndarray, "n nq"], source: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Origin and axis of each pulse, axes of the microphones, and which of them the body hides."""
    model, data = rig.model, rig.data
    receivers = len(rig.microphone_sites)
    origin, axis = np.empty((len(poses), 3)), np.empty((len(poses), 3))
    occluded = np.zeros((len(poses), receivers), bool)
    outward = np.empty((len(poses), receivers, 3))
    geom, reach = np.empty(receivers, np.int32), np.empty(receivers)
    for i, q in enumerate(poses):
        place(rig, q)
        site = rig.source_sites[source[i]]
        origin[i] = data.site_xpos[site]
        axis[i] = data.site_xmat[site].reshape(3, 3)[:, 2]
        start = origin[i] + _RAY_CLEARANCE * axis[i]
        outward[i] = data.site_xmat[rig.microphone_sites].reshape(-1, 3, 3)[:, :, 2]
        ray = data.site_xpos[rig.microphone_sites] + _RAY_CLEARANCE * outward[i] - start
        length = np.linalg.norm(ray, axis=1)
        ray /= np.maximum(length, 1e-9)[:, None]
        mujoco.mj_multiRay(
            model, data, start, ray.ravel(), None, False, -1, geom, reach, None, receivers,
            float(length.max()) + 0.1,
        )  # fmt: skip
        occluded[i] = (reach >= 0) & (reach < length)
    return origin, axis, outward, occluded

"""What the filter's frames are computed from: the model, its numbers, and measurements."""

from __future__ import annotations

from typing import NamedTuple

from jax import Array
from jaxtyping import Float, Int

from mocap_jax.kalman import Dynamics, Process, SigmaPoints


class FilterModel(NamedTuple):
    """What stays fixed over the frames (hashable: static under `jit`)."""

    process: Process
    kinds: str
    """Letters of the measurements that the recording really holds, R for the root pose, V for tilts
    by boards that do not accelerate."""
    sensors: tuple[int, ...]
    """Sites of the sensors."""
    range_sites: tuple[int, ...]
    """Sites that take part in ranges."""
    range_gate: float
    range_facing: bool = True
    """Leave out ranges whose receiver is behind the source at the estimated pose."""
    sigma_points: SigmaPoints | None = None
    """Of the unscented filter; None: derivatives, as in the extended one."""
    limits: bool = False
    """Cut beliefs off at the ranges of hinges and slides."""


class Parameters(NamedTuple):
    """Numbers of the filter (traced)."""

    dynamics: Dynamics
    accelerometer_sigma: Float[Array, "s"]
    gyroscope_sigma: Float[Array, "s"]
    orientation_sigma: Float[Array, "s"]
    range_sigma: Float[Array, ""]
    root_sigma: Float[Array, "6"]
    lever_arm_sigma: Float[Array, ""]
    mounting_sigma: Float[Array, ""]
    """Remaining error of the sensors' mounting rotation [rad]."""
    speed_of_sound: Float[Array, ""]
    magnetic: Float[Array, "4"]
    """Direction of north and deviation of a heading [rad], frames that share one error, and frames
    within which headings are corrected in any case."""
    gravity: Float[Array, "4"] | tuple[()] = ()
    """The same of tilts by boards that do not accelerate: deviation [rad], both numbers of frames,
    and deviations at which a tilt counts half. Empty without a gravity reference, as the next."""


class FrameInput(NamedTuple):
    """Measurements of one frame, or of t frames stacked in front."""

    valid: Float[Array, ""]
    """False for the padding after the last frame."""
    first: Float[Array, ""]
    """True for the first frame, which has no step before it."""
    accelerometer: Float[Array, "s 3"]
    gyroscope: Float[Array, "s 3"]
    orientation: Float[Array, "s 4"]
    range_distance: Float[Array, "k"]
    range_weight: Float[Array, "k"]
    range_source: Int[Array, "k"]
    """Place in `FilterModel.range_sites`."""
    range_receiver: Int[Array, "k"]
    range_lead: Float[Array, "k"]
    """[frames]"""
    root_position: Float[Array, "3"]
    root_orientation: Float[Array, "4"]
    magnetic: Float[Array, "s 3"]
    gravity: Float[Array, "s 3"] | tuple[()] = ()
    """What boards feel that do not accelerate [m/s^2]."""

"""Static and numeric description of one whole-sequence problem, cut into equal chunks of frames."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import jax
import numpy as np
from jax import Array
from jaxtyping import Float, Int

from mocap_jax.body import Topology
from mocap_jax.estimate.sequence.user_residuals import UserResidual


@dataclass(frozen=True)
class Layout:
    """What decides the shape of the traced graph; hashable."""

    topology: Topology
    sites: tuple[int, ...]
    """Site of each sensor."""
    range_sites: tuple[int, ...]
    """Sites that appear in ranges (sources and receivers)."""
    root_body: int
    use_acceleration: bool
    use_rate: bool
    use_orientation: bool
    use_range: bool
    use_border: bool
    force_weights: tuple[float, float, float]
    smoothness_order: int
    inertial_loss: str
    range_loss: str
    user: tuple[UserResidual, ...] = ()
    chunk: int = 128
    pose_joints: tuple[tuple[int, int], ...] = ()
    """Child and parent segment of the joints of the pose prior."""
    lengths: tuple[int, ...] = ()
    """Bodies whose offset from their parent has an unknown length."""
    sources: tuple[int, ...] = ()
    """Positions in `range_sites` of sources whose place on their segment is unknown."""
    use_sound: bool = False
    """The speed of sound is unknown."""
    emitters: tuple[int, ...] = ()
    """Positions in `range_sites` of sources whose ranges have an unknown constant error."""
    use_accelerometer_scale: bool = False
    """Accelerometers have unknown scale errors (this and the following: `Corrections`)."""
    use_gyroscope_scale: bool = False
    use_clock_offset: bool = False
    use_heading: bool = False
    gyroscope_steps: int = 0
    """Steps that the biases of gyroscopes take from knot to knot; 0 where they are constant."""
    accelerometer_steps: int = 0
    contact_bodies: tuple[int, ...] = ()
    """Segment of each point of a foot that may stand on the ground."""
    contact_loss: str = "none"
    measured_rotation: bool = False
    """Accelerations are turned into the world by measured orientations, not by those
    that are solved for."""
    use_gravity: bool = False
    """Still boards say which way is down (see `gravity_terms`)."""
    gravity_loss: str = "none"

    @property
    def half_bandwidth(self) -> int:
        """Frames that the normal equations couple on either side."""
        user = max((r.window - 1 for r in self.user), default=0)
        return max(2, self.smoothness_order, user)

    @property
    def halo(self) -> int:
        """Frames beyond a chunk that its equations need on either side."""
        return self.half_bandwidth

    @property
    def geometry(self) -> int:
        """Number of border unknowns that belong to no sensor (`Geometry`)."""
        return sum(self.geometry_sizes)

    @property
    def geometry_sizes(self) -> tuple[int, int, int, int]:
        """Number of lengths, source coordinates, speeds of sound and range offsets."""
        sources, emitters = 3 * len(self.sources), len(self.emitters)
        return len(self.lengths), sources, int(self.use_sound), emitters

    @property
    def sensor_sizes(self) -> dict[str, int]:
        """Border columns of a sensor by kind of constant, in their order; 0 where one is off."""
        return {
            "gyroscope_bias": 3,
            "accelerometer_bias": 3,
            "mounting": 3,
            "offset": 3,
            "accelerometer_scale": 3 * self.use_accelerometer_scale,
            "gyroscope_scale": 3 * self.use_gyroscope_scale,
            "clock_offset": int(self.use_clock_offset),
            "heading": int(self.use_heading),
            "gyroscope_walk": 3 * self.gyroscope_steps,
            "accelerometer_walk": 3 * self.accelerometer_steps,
        }

    @property
    def sensor_cells(self) -> dict[str, slice]:
        """Where each kind of constant stands among those of a sensor."""
        sizes = self.sensor_sizes
        ends = np.cumsum([0, *sizes.values()])
        return {
            k: slice(int(a), int(b)) for k, a, b in zip(sizes, ends[:-1], ends[1:], strict=True)
        }

    @property
    def per_sensor(self) -> int:
        """Border columns of a sensor."""
        return sum(self.sensor_sizes.values())

    @property
    def all_constants(self) -> int:
        """Number of constants, border or not: those of all sensors, then the geometry."""
        return self.per_sensor * len(self.sites) + self.geometry

    @property
    def constants(self) -> int:
        """Number of border unknowns."""
        return self.all_constants if self.use_border else 0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Terms:
    """Measurements and information (inverse variances, zero where absent) of every frame.

    All arrays have t frames first; `Problem` pads them so that chunks with halos can be cut.
    Row k holds the residual centred at frame k (rates: the interval k to k + 1).
    """

    force: Float[Array, "t s 3"]
    force_information: Float[Array, "t s"]
    rate: Float[Array, "t s 3"]
    mean_rate: Float[Array, "t s 3"]
    rate_information: Float[Array, "t s"]
    orientation: Float[Array, "t s 3 3"]
    orientation_information: Float[Array, "t s"]
    range_distance: Float[Array, "t k"]
    range_information: Float[Array, "t k"]
    range_source: Int[Array, "t k"]
    """Position in `Layout.range_sites`."""
    range_receiver: Int[Array, "t k"]
    range_lead: Float[Array, "t k"]
    range_flight: Float[Array, "t k"]
    reference: Float[Array, "2 t nq"]
    """Reference poses: measured root and declared rest pose; weak prior pose."""
    reference_information: Float[Array, "2 t nv"]
    smoothness_information: Float[Array, "t nv"]
    """Row k: the difference whose window starts at frame k - 1 (order 2) or k - 1 (order 3)."""
    limit_information: Float[Array, "t"]
    pose_information: Float[Array, "t"]
    """How many independent poses a frame counts as, for the pose prior."""
    pace_information: Float[Array, "t"]
    """Of the change to the next frame, 1 / step [1/s]; zero after the last frame."""
    user_data: tuple = ()
    user_mask: tuple = ()
    force_slopes: tuple[Float[Array, "t s 3"], ...] = ()
    """First and second time derivative of `force`, where clock offsets are unknown."""
    rate_slopes: tuple[Float[Array, "t s 3"], ...] = ()
    mean_rate_slopes: tuple[Float[Array, "t s 3"], ...] = ()
    walk: tuple[Float[Array, "t n"], ...] = ()
    """What each step of a walk adds to a bias (see `walk.Walk`), where biases walk."""
    contact: tuple[Float[Array, "t p"], ...] = ()
    """Where feet may stand (see `contact_terms`): information of each point's displacement to the
    next frame; of its height over the ground in contact; of its depth below it otherwise."""
    gravity: tuple[Array, ...] = ()
    """What boards feel, (t, s, 3), and the information of its direction, (t, s): zero where they
    are not still. Empty where there is no gravity reference."""


def frame_axis(name: str) -> int:
    """Axis of the frames in a field of `Terms`."""
    return 1 if name in ("reference", "reference_information") else 0


def repeats_at_ends(name: str) -> bool:
    """Whether a field of `Terms` goes on beyond the sequence (rotations); others are zero there."""
    return name in ("reference", "orientation")


def by_field(terms: Terms, function: Callable[[str, Array], Array]) -> Terms:
    """A function of (field name, array) on all arrays."""
    changes = {
        f.name: jax.tree.map(lambda x, name=f.name: function(name, x), getattr(terms, f.name))
        for f in dataclasses.fields(Terms)
    }
    return Terms(**changes)


class Gaussian(NamedTuple):
    """The pose prior on one body; without joints where there is none."""

    child_frame: Float[Array, "j 3 3"]
    """R_segment_anatomical of the joints' children."""
    parent_mean: Float[Array, "j 3 3"]
    """Where that frame is in the parent segment at the mean rotation."""
    whitening: Float[Array, "3j 3j"]
    """Inverse of the covariance's Cholesky factor [1/rad], and unevenness of joints that share."""
    pace: Float[Array, "3j 3j"]
    """The same of changes, from the prior's mobility [sqrt(s)/rad]; zero where it is not known."""


class Ground(NamedTuple):
    """Points of the feet, and what they stand on; without points where contacts are off."""

    points: Float[Array, "p 3"]
    """In their segments' frames [m]."""
    height: Float[Array, ""]
    """Height of standing points [m]."""
    scale: Float[Array, ""]
    """Whitened size beyond which a contact is none."""
    share: Float[Array, ""]
    """How much of an independent observation of the height a frame is."""
    mu: Float[Array, ""]
    """Graduation of Geman-McClure."""


NO_GROUND = Ground(np.zeros((0, 3)), *(np.asarray(x) for x in (0.0, 1.0, 1.0, 1.0)))


NO_PRIOR = Gaussian(np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), np.zeros((0, 0)), np.zeros((0, 0)))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Weights:
    """Numbers a solve may change without tracing again."""

    step: Float[Array, ""]
    inertial_scale: Float[Array, ""]
    """Whitened norm beyond which an inertial residual is an outlier."""
    range_scale: Float[Array, ""]
    range_mu: Float[Array, ""]
    """Graduation of Geman-McClure."""
    limit_softness: Float[Array, ""]
    pose_prior: Gaussian = NO_PRIOR
    ground: Ground = NO_GROUND
    gravity_scale: Float[Array, ""] = field(default_factory=lambda: np.asarray(1.0))
    """Whitened norm beyond which a still board's tilt is an outlier."""

"""`OptimiseOptions`: every choice of the whole-sequence optimiser, with its default's reason."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from mocap_jax.estimate.contact.options import ContactOptions
from mocap_jax.estimate.gravity_options import GravityOptions
from mocap_jax.estimate.sequence.user_residuals import UserResidual
from mocap_jax.least_squares import SolverOptions
from mocap_jax.pose_prior import PosePrior
from mocap_jax.residuals.robust import LossName


@dataclass(frozen=True)
class ConstantsOptions:
    """Constants solved for with the motion (the border of the normal equations).

    Lengths, source positions, speed of sound and range offsets are what distances measure poses by:
    they are solved for when distances are used and the constants of boards are. What determines
    which constant: docs/self_calibration.md.
    """

    gyroscope_bias_sigma: float = 0.01
    """Prior standard deviation [rad/s] (consumer MEMS after warm-up, about 0.5 deg/s); 0 = off."""
    still_turn: float = 0.005
    """How far a person who holds still turns during the rest hold in all [rad]: over its duration,
    the gyroscopes' mean reading in it is their bias to this much. 0 = take no bias from it."""
    accelerometer_bias_sigma: float = 0.15
    """Prior standard deviation [m/s^2] (15 mg, consumer MEMS); 0 = off."""
    mounting_sigma: float = 0.05
    """Prior standard deviation of each mounting rotation component [rad]; 0 = off."""
    offset_sigma: float = 0.015
    """Prior standard deviation of each component of a sensor's position on its segment [m]
    (palpation, Della Croce et al. 2005: 6 to 25 mm); 0 = off."""
    accelerometer_scale_sigma: float = 0.0
    """Prior standard deviation of the scale error of each axis, relative; 0 = off. Consumer MEMS:
    0.01 to 0.03 (InvenSense MPU-6050 specification 3.4: 3 % initial tolerance)."""
    gyroscope_scale_sigma: float = 0.0
    """The same of gyroscopes (3 % as well); 0 = off."""
    clock_offset_sigma: float = 0.0
    """Prior standard deviation of a board's stamps against the clock of root and ranges [s]; 0 =
    off. Radio-connected boards: 0.002 to 0.01 (a sample or so). Readings are moved in time by
    their slopes, which holds for offsets up to about two samples."""
    heading_sigma: float = 0.0
    """Prior standard deviation of a rotation of each sensor's measured orientations about the
    vertical [rad]; 0 = off. Indoors magnetic fields are disturbed, most near floors (de Vries et
    al. 2009, Gait & Posture 29, 535-541); 0.2 is a cautious figure. Only where orientations are
    measured."""
    bias_interval: float = 0.0
    """Biases are piecewise linear between knots this far apart at most [s]; 0 = constant. Each knot
    takes three unknowns a sensor kind and board, of which there may be 1000 in all."""
    gyroscope_walk_sigma: float = 2e-4
    """Random walk of a gyroscope's bias between knots [rad/s/sqrt(s)] (rate random walk of consumer
    MEMS; El-Sheimy, Hou, Niu 2008, IEEE Trans. Instrum. Meas. 57, 140-149); 0 = constant. Counts
    only with `bias_interval`, as the next."""
    accelerometer_walk_sigma: float = 1e-3
    """The same of an accelerometer's bias [m/s^2/sqrt(s)]."""
    length_sigma: float = 0.04
    """Prior standard deviation of segment lengths, relative to the body's (regression from stature,
    Winter 2009, chapter 4: a few per cent); 0 = off."""
    source_sigma: float = 0.015
    """Prior standard deviation of each component of a source's position [m]; 0 = off."""
    sound_sigma: float = 0.01
    """Prior standard deviation of the speed of sound, relative (air temperature known to 6
    degrees); 0 = off."""
    range_offset_sigma: float = 0.003
    """Prior standard deviation of a constant error of each source's ranges [m] (Vlasic 2007,
    section 4.3: 2.35 mm in the mean after calibration); 0 = off."""
    adapt: bool = True
    """Lower these figures to what the recording shows (variance components)."""

    @property
    def corrections(self) -> tuple[str, ...]:
        """Names of the options by which errors beyond bias, mounting and place are switched on."""
        names = ("accelerometer_scale_sigma", "gyroscope_scale_sigma", "clock_offset_sigma",
                 "heading_sigma", "bias_interval")  # fmt: skip
        return tuple(name for name in names if getattr(self, name))


@dataclass(frozen=True)
class NoiseOptions:
    """How measurements are whitened; the white figures come from the recording's set-up."""

    model_errors: bool = True
    """Add the model errors below to the declared noise."""
    lever_arm_sigma: float = 0.01
    """Error of sensor positions on their segments, r [m]: adds r^2 (|alpha|^2 + |w|^4) to the
    variance of accelerations (palpation, Della Croce et al. 2005: about a centimetre)."""
    lag: float = 0.02
    """Error of timing [s]: boards lag and ring on soft tissue (resonances of 8 to 20 Hz; Wakeling
    and Nigg 2001) and clocks are off. Adds lag^2 times the squared jerk to the variance of
    accelerations, and lag^2 |alpha|^2 to that of rates. Such errors repeat with the motion, so
    the figure is about twice the lag itself."""
    independent_samples: float = 330.0
    """How many samples of a sensor are evidence for its constants, however long the recording.
    Model errors repeat with the motion (tissue slides alike in like poses), so more of it is no
    fresh evidence: longer recordings count as this many samples. Twice to four times as many
    bend mountings in recordings of 30 to 40 s; half as many find too little of them in short
    ones. (See `prior_information`.)"""
    accelerometer_model: float = 0.2
    """What remains in quiet moments [m/s^2]: drift, and a degree of tilt."""
    gyroscope_model: float = 0.03
    """The same of rates [rad/s]."""
    orientation_model: float = 0.03
    """The same of measured orientations [rad]."""
    range_model: float = 0.01
    """What remains of ranges beside the constants [m]: soft tissue, which slides by millimetres to
    centimetres (Leardini et al. 2005)."""
    adapt: bool = True
    """Lower the model errors, and the rest pose's, to what the recording shows."""
    excess_margin: float = 8.0
    """Model error kept, over the excess of residuals that is found (poses follow most of it); 1
    where most sensors show none."""
    rounds: int = 5
    """Solves with levels re-estimated in between."""
    inertial_loss: LossName = "huber"
    """Robust loss of accelerations, rates and orientations."""
    inertial_scale: float = 5.0
    """Its threshold, in standard deviations (norm of three components)."""
    range_loss: LossName = "cauchy"
    """Robust loss of ultrasonic ranges (multipath)."""
    range_scale: float = 3.0
    """Its threshold, in standard deviations."""
    range_facing: bool = True
    """Leave out ranges whose receiver is behind the source (`EkfOptions.range_facing`)."""
    range_mu: tuple[float, ...] = (16.0, 4.0, 1.0)
    """Graduation of `geman_mcclure` over the rounds (Yang et al. 2020)."""


@dataclass(frozen=True)
class PriorOptions:
    """What is assumed about human motion and poses."""

    smoothness_order: Literal[2, 3] = 2
    """2: white acceleration; 3: white jerk (one more block of bandwidth)."""
    smoothness_density: float = 600.0
    """Spectral density of joint acceleration [rad^2/s^3], or jerk [rad^2/s^5] for order 3. It is
    loose (300 rad/s^2 a frame at 140 Hz): the pull of a tight one on fast motion looks like noise
    of the sensors."""
    shared_smoothness_density: float = 60.0
    """The same for joints between two boards with more than three degrees of freedom in all (spine,
    neck): boards see only their sum, and what they do against each other is left to this prior."""
    translation_density: float = 20.0
    """The same for root translation and slides [m^2/s^3, m^2/s^5]."""
    rest_sigma: float = 0.05
    """Declared rest pose: standard deviation of each joint coordinate [rad]."""
    pose_sigma: float = 0.5
    """Weak prior on poses around the reference pose [rad, m], per second of recording; it only
    matters for joints that no sensor observes."""
    knee_sigma: float = 0.05
    """How far the knee of a body with ball joints there is from a hinge [rad]: standard deviation
    of the rotation about each axis other than flexion (Lafortune et al. 1992: a few degrees);
    0 = off. Bodies whose knees are hinges have no such rotation."""
    share_sigma: float = 0.1
    """How unevenly joints of the trunk, and of the neck, share the rotation that the pose prior
    knows of them together [rad]: 3 to 10 degrees in CMU motion. Counts only with a pose prior."""
    skin_sigma: float = 0.0
    """How far boards move on their segments, per axis [m] (Leardini et al. 2005: millimetres to
    centimetres); 0 = off. With it, displacements are unknowns of every frame: such errors of
    acceleration are large at high frequencies and nothing at low ones, which is what few boards
    are told apart by."""
    skin_frequency: float = 10.0
    """Up to which frequency they do [Hz] (soft tissue rings at 8 to 20 Hz; Wakeling and Nigg
    2001)."""
    limits: bool = True
    """Penalise joint coordinates outside their range."""
    limit_sigma: float = 0.03
    """Standard deviation of a limit violation that lasts a second [rad, m]."""
    limit_softness: float = 0.01
    """Width of the transition at a limit [rad, m]."""


@dataclass(frozen=True)
class OptimiseOptions:
    """Options of `optimise`."""

    kinds: str = "AGDO"
    """Measurements used: A accelerometer, G gyroscope, D distance, O orientation, M magnetometer
    (its heading alone). In a declared rest hold the accelerometers count in any case: they tell
    tilt."""
    root: Literal["auto", "given", "free"] = "auto"
    """Use the externally measured root pose; "auto" does when the recording has it."""
    rate_hz: float | None = None
    """Frame grid; default the highest inertial rate."""
    stencil: Literal["consistent", "plain"] = "consistent"
    """Acceleration stencil: fourth order, or the papers' plain second difference."""
    acceleration_rotation: Literal["model", "measured"] = "model"
    """What turns accelerometers' readings into the world: the rotation that is solved for, which
    lets gravity tell tilt, or the measured orientation (von Marcard 2017, eq. 13)."""
    initial: Literal["ekf", "ekf_smoothed", "orientation"] = "ekf_smoothed"
    """What makes the initial guess when none is given."""
    magnetic_north: float | None = None
    """Kind M: direction of magnetic north in the world, from X about Z [rad]; None: where the
    magnetometers have it in the pose at rest."""
    magnetic_sigma: float = 0.2
    """Kind M: standard deviation of a heading [rad] (de Vries et al. 2009: tenths of a radian
    indoors); one that is far off counts less."""
    magnetic_time: float = 5.0
    """Kind M: how long such an error lasts [s]; frames within it count as one."""
    constants: ConstantsOptions = field(default_factory=ConstantsOptions)
    noise: NoiseOptions = field(default_factory=NoiseOptions)
    prior: PriorOptions = field(default_factory=PriorOptions)
    solver: SolverOptions = field(default_factory=SolverOptions)
    covariance: bool = True
    """Compute the marginal covariance of every pose."""
    pair_covariance: bool = False
    """Compute the covariance of every pose with the next too (nv^2 doubles a frame more): what the
    uncertainty of velocities needs. Only with `covariance`."""
    chunk: int = 128
    """Frames per traced chunk."""
    dtype: Literal["float64", "float32"] = "float64"
    """Precision of residuals and Jacobians; the linear solve is float64."""
    pose_prior: PosePrior | None = None
    """What poses people take (`default_pose_prior()`, or one of your own). It stands in for
    `PriorOptions.pose_sigma` at the joints it knows."""
    contacts: ContactOptions | None = None
    """Feet that stand on the ground do not move (`ContactOptions()`); None = off. What a free root
    drifts by is mostly gone then. The body needs feet by name."""
    gravity: GravityOptions | None = None
    """Boards that do not accelerate tell which way is down (`GravityOptions()`), whether or not
    `kinds` has A; None = off."""
    user_residuals: tuple[UserResidual, ...] = ()
    """The user's own residuals, see `UserResidual`."""

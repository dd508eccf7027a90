"""`EkfOptions`: what the filter assumes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.estimate.gravity_options import GravityOptions
from mocap_jax.initialise import RestOptions

_PROCESSES = ("white_jerk", "paper", "euler")
_ROOTS = ("auto", "given", "free")


@dataclass(frozen=True)
class EkfOptions:
    """Options of `ekf` and `ukf`."""

    kinds: str = "AGDO"
    """Measurements to use: A accelerometers, G gyroscopes, D distances, O orientations, M
    magnetometers (headings alone)."""
    root: Literal["auto", "given", "free"] = "auto"
    """Use the measured root pose (`auto`: when the recording has one)."""
    rate_hz: float | None = None
    """Frame grid; default the highest inertial rate (120 Hz without inertial data)."""
    process: Literal["white_jerk", "paper", "euler"] = "white_jerk"
    """Dynamics; `paper` puts noise on the acceleration only, `euler` steps as eq. 1 is printed."""
    joint_jerk_density: float = 1e4
    """Of joint angles [rad^2/s^5]; the larger innovation likelihood of 1e3 and 1e4 on the CMU clips
    02_01 and 02_05 (`scripts/tune_process_noise`)."""
    slide_jerk_density: float = 3e2
    """Of sliding joints [m^2/s^5]."""
    root_rotation_jerk_density: float = 1e4
    """Of the root's rotation [rad^2/s^5]."""
    root_translation_jerk_density: float = 3e3
    """Of the root's translation, in world coordinates [m^2/s^5]."""
    joint_sigma: float = 1.0
    """Standard deviation of joint angles about the rest pose over long times [rad]: joints follow
    a third-order Butterworth process of this size with the jerk density above. 0 makes it a plain
    random walk of the acceleration."""
    shared_joint_sigma: float = 0.1
    """The same for joints between two boards with more than three degrees of freedom in all (a
    spine in four joints): the boards see their sum only, and its parts must not run away [rad].
    (At 0.35 the trunk folds: joint centres of 02_01 are off by 7 to 14 cm, at 0.1 by 5 cm.)"""
    paper_acceleration_noise: float = 0.04
    """Of `paper` and `euler`: standard deviation of the change of joint accelerations in 1/140 s
    [rad/s^2] (Vlasic 2007, section 5.1). The root, which the paper takes from elsewhere, keeps
    its jerk density."""
    smooth: bool = False
    """Run the backward (Rauch-Tung-Striebel) pass as well: estimates then use all data."""
    remove_averaging: bool = True
    """Undo, to second order, that an inertial sample is the mean over its interval:
    m - (m_before - 2 m + m_after) / 24."""
    lever_arm_sigma: float = 0.002
    """Error of sensor positions sigma_r [m]: the accelerometers' variance is raised by
    sigma_r^2 (|alpha|^2 + |w|^4)."""
    lever_arm_model: float = 0.02
    """The same for boards on a person, wobble on soft tissue included [m]. This and `range_model`
    count as far as the rest hold shows errors at all: times 0 where gravity is where declared
    pose and mounting have it, to 1 where they are off by 3 degrees or no hold is declared."""
    range_model: float = 0.2
    """Errors of distances beside their noise on a person: segment lengths, positions of boards and
    sources, soft tissue [m]. They are centimetres, but last: taken for noise, which averages out,
    they must count as more."""
    range_gate: float = 4.0
    """Ranges whose innovation exceeds this many standard deviations are trusted less (multipath);
    0 switches it off."""
    range_facing: bool = True
    """Leave out ranges whose receiver is behind the source at the estimated pose (w_a of Vlasic
    2007, section 4.1). Off where sources radiate all around, or where the data hardly tell which
    way they face."""
    limits: bool = False
    """Cut beliefs off at the ranges of hinges and slides (`kalman.truncate`): for joints that
    reach their limits where measurements have two solutions, as an arm's full extension. Off, the
    ranges count in the whole-sequence optimiser alone."""
    magnetic_north: float | None = None
    """Kind M: direction of magnetic north in the world, from X about Z [rad]; None: where the
    magnetometers have it in the pose at rest."""
    magnetic_sigma: float = 0.2
    """Kind M: standard deviation of a heading [rad] (de Vries et al. 2009: tenths of a radian
    indoors); one that is far off counts less."""
    magnetic_time: float = 5.0
    """Kind M: how long such an error lasts [s]; frames within it count as one."""
    magnetic_pull: float = 5.0
    """Kind M: undisturbed headings are corrected within this time at least [s], however well the
    filter believes to know them: drifting biases of rates are no part of its belief."""
    gravity: GravityOptions | None = None
    """Boards that do not accelerate tell which way is down (`GravityOptions()`), whether or not
    `kinds` has A; None = off."""
    velocity_sigma: float = 3.0
    """Prior of joint and root velocities at the first frame, when it is not at rest
    [rad/s, m/s]."""
    acceleration_sigma: float = 30.0
    """Prior of accelerations at the first frame, when it is not at rest [rad/s^2, m/s^2]."""
    rest_velocity_sigma: float = 0.02
    """The same at rest [rad/s, m/s]."""
    rest_acceleration_sigma: float = 0.5
    """The same at rest [rad/s^2, m/s^2]."""
    rest: RestOptions = RestOptions()
    """What to estimate from the rest hold before filtering."""
    covariance: bool = True
    """Return the marginal covariance of every pose (nv^2 doubles a frame)."""
    pair_covariance: bool = False
    """Return the covariance of every pose with the next too, which the uncertainty of velocities
    needs. The smoother's alone: a filter's estimates of successive frames rest on different
    data."""
    chunk: int = 128
    """Frames compiled into one call; the checkpoint interval of the smoother."""
    dtype: Literal["float64", "float32"] = "float64"
    """Precision of the computation."""

    def __post_init__(self) -> None:
        if self.process not in _PROCESSES:
            raise unknown_name("process", self.process, _PROCESSES)
        if self.root not in _ROOTS:
            raise unknown_name("root", self.root, _ROOTS)
        if self.dtype not in ("float64", "float32"):
            raise unknown_name("dtype", self.dtype, ("float64", "float32"))
        if self.pair_covariance and not (self.smooth and self.covariance):
            raise InputError("pair_covariance=True needs smooth=True and covariance=True")
        if not min(self.magnetic_sigma, self.magnetic_time, self.magnetic_pull) > 0:
            raise InputError("magnetic_sigma, magnetic_time, magnetic_pull: must be above 0")
        if self.chunk < 2:
            raise InputError(f"chunk={self.chunk}: must be at least 2 frames")

"""Human motion from body-worn sensors: recordings in, whole-sequence estimates out.

Importing the package enables 64-bit JAX (`jax_enable_x64`) for the whole process. The names below
are loaded on first use, so that the import itself stays light.
"""

from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

import jax

jax.config.update("jax_enable_x64", True)

try:
    __version__ = version("mocap_jax")
except PackageNotFoundError:  # a source tree that was never installed
    __version__ = "0+unknown"

if TYPE_CHECKING:
    from mocap_jax.body import Body as Body
    from mocap_jax.body import difference as difference
    from mocap_jax.body import frames as frames
    from mocap_jax.body import load_body as load_body
    from mocap_jax.body import retract as retract
    from mocap_jax.body import site_frames as site_frames
    from mocap_jax.body import transport as transport
    from mocap_jax.calibration import calibrate_accelerometer as calibrate_accelerometer
    from mocap_jax.calibration import calibrate_gyroscope as calibrate_gyroscope
    from mocap_jax.calibration import calibrate_noise as calibrate_noise
    from mocap_jax.calibration import calibrate_source_offsets as calibrate_source_offsets
    from mocap_jax.compilation_cache import enable_compilation_cache as enable_compilation_cache
    from mocap_jax.conversion import ConvertOptions as ConvertOptions
    from mocap_jax.conversion import convert as convert
    from mocap_jax.conversion import wear as wear
    from mocap_jax.errors import InputError as InputError
    from mocap_jax.errors import MocapError as MocapError
    from mocap_jax.errors import SolveError as SolveError
    from mocap_jax.estimate import AnchorRanges as AnchorRanges
    from mocap_jax.estimate import ConstantsOptions as ConstantsOptions
    from mocap_jax.estimate import ContactOptions as ContactOptions
    from mocap_jax.estimate import EkfOptions as EkfOptions
    from mocap_jax.estimate import GravityOptions as GravityOptions
    from mocap_jax.estimate import MountingCalibration as MountingCalibration
    from mocap_jax.estimate import NoiseOptions as NoiseOptions
    from mocap_jax.estimate import Odometry as Odometry
    from mocap_jax.estimate import OptimiseOptions as OptimiseOptions
    from mocap_jax.estimate import OrientationPassOptions as OrientationPassOptions
    from mocap_jax.estimate import PriorOptions as PriorOptions
    from mocap_jax.estimate import RangeOnlyOptions as RangeOnlyOptions
    from mocap_jax.estimate import SingleImuOptions as SingleImuOptions
    from mocap_jax.estimate import UserResidual as UserResidual
    from mocap_jax.estimate import absolute_position as absolute_position
    from mocap_jax.estimate import calibrate_mounting as calibrate_mounting
    from mocap_jax.estimate import check_residual as check_residual
    from mocap_jax.estimate import differentiable as differentiable
    from mocap_jax.estimate import differentiable_ekf as differentiable_ekf
    from mocap_jax.estimate import ekf as ekf
    from mocap_jax.estimate import joint_axes as joint_axes
    from mocap_jax.estimate import joint_limits as joint_limits
    from mocap_jax.estimate import magnetic_heading as magnetic_heading
    from mocap_jax.estimate import optimise as optimise
    from mocap_jax.estimate import orientation_pass as orientation_pass
    from mocap_jax.estimate import range_only_path as range_only_path
    from mocap_jax.estimate import smooth_orientation as smooth_orientation
    from mocap_jax.estimate import sparse_options as sparse_options
    from mocap_jax.estimate import table1_options as table1_options
    from mocap_jax.estimate import ukf as ukf
    from mocap_jax.initialise import Heading as Heading
    from mocap_jax.initialise import JointFinding as JointFinding
    from mocap_jax.initialise import JointOptions as JointOptions
    from mocap_jax.initialise import SensorCheck as SensorCheck
    from mocap_jax.initialise import calibrate_to_pose as calibrate_to_pose
    from mocap_jax.initialise import check_readings as check_readings
    from mocap_jax.initialise import check_sensors as check_sensors
    from mocap_jax.initialise import find_joint as find_joint
    from mocap_jax.initialise import joint_recording as joint_recording
    from mocap_jax.initialise import with_orientations as with_orientations
    from mocap_jax.io import export_motion as export_motion
    from mocap_jax.io import read_recording as read_recording
    from mocap_jax.io import read_solution as read_solution
    from mocap_jax.io import write_recording as write_recording
    from mocap_jax.io import write_solution as write_solution
    from mocap_jax.kalman import SigmaPoints as SigmaPoints
    from mocap_jax.metrics import chi_square_band as chi_square_band
    from mocap_jax.metrics import coverage as coverage
    from mocap_jax.metrics import evaluate as evaluate
    from mocap_jax.metrics import joint_consistency as joint_consistency
    from mocap_jax.metrics import nees as nees
    from mocap_jax.metrics import nis as nis
    from mocap_jax.motion import BUILTIN_MOTIONS as BUILTIN_MOTIONS
    from mocap_jax.motion import Motion as Motion
    from mocap_jax.motion import ball_jointed as ball_jointed
    from mocap_jax.motion import builtin_motion as builtin_motion
    from mocap_jax.motion import cut_motion as cut_motion
    from mocap_jax.motion import human as human
    from mocap_jax.motion import human_like as human_like
    from mocap_jax.motion import load_motion as load_motion
    from mocap_jax.motion import load_skeleton as load_skeleton
    from mocap_jax.motion import retarget as retarget
    from mocap_jax.motion import retarget_errors as retarget_errors
    from mocap_jax.motion import segment_lengths as segment_lengths
    from mocap_jax.motion import with_segment_lengths as with_segment_lengths
    from mocap_jax.placement import PlacementOptions as PlacementOptions
    from mocap_jax.placement import PlacementStudy as PlacementStudy
    from mocap_jax.placement import place as place
    from mocap_jax.pose_prior import JointLimits as JointLimits
    from mocap_jax.pose_prior import PosePrior as PosePrior
    from mocap_jax.pose_prior import default_pose_prior as default_pose_prior
    from mocap_jax.pose_prior import learn_joint_limits as learn_joint_limits
    from mocap_jax.pose_prior import learn_pose_prior as learn_pose_prior
    from mocap_jax.pose_prior import load_pose_prior as load_pose_prior
    from mocap_jax.pose_prior import save_pose_prior as save_pose_prior
    from mocap_jax.recording import Calibration as Calibration
    from mocap_jax.recording import Recording as Recording
    from mocap_jax.recording import Setup as Setup
    from mocap_jax.recording import calibrated as calibrated
    from mocap_jax.recording import cut as cut
    from mocap_jax.recording import uncalibrated as uncalibrated
    from mocap_jax.recording import with_calibration as with_calibration
    from mocap_jax.report import write_animation as write_animation
    from mocap_jax.report import write_report as write_report
    from mocap_jax.simulation import SimulationOptions as SimulationOptions
    from mocap_jax.simulation import simulate as simulate
    from mocap_jax.solution import Solution as Solution
    from mocap_jax.solution import Status as Status
    from mocap_jax.solution import determination as determination
    from mocap_jax.solution import uncertainty as uncertainty
    from mocap_jax.trajectory import Trajectory as Trajectory

_HOME = {
    "body": ("Body", "difference", "frames", "load_body", "retract", "site_frames", "transport"),
    "calibration": (
        "calibrate_accelerometer", "calibrate_gyroscope", "calibrate_noise",
        "calibrate_source_offsets",
    ),
    "compilation_cache": ("enable_compilation_cache",),
    "conversion": ("ConvertOptions", "convert", "wear"),
    "errors": ("InputError", "MocapError", "SolveError"),
    "estimate": (
        "AnchorRanges", "ConstantsOptions", "ContactOptions", "EkfOptions", "GravityOptions",
        "MountingCalibration",
        "NoiseOptions", "Odometry", "OptimiseOptions", "OrientationPassOptions", "PriorOptions",
        "RangeOnlyOptions", "SingleImuOptions", "UserResidual", "absolute_position",
        "calibrate_mounting", "check_residual", "differentiable", "differentiable_ekf", "ekf",
        "joint_axes", "joint_limits", "magnetic_heading", "optimise", "orientation_pass",
        "range_only_path", "smooth_orientation", "sparse_options", "table1_options", "ukf",
    ),
    "kalman": ("SigmaPoints",),
    "initialise": (
        "Heading", "JointFinding", "JointOptions", "SensorCheck", "calibrate_to_pose",
        "check_readings", "check_sensors", "find_joint", "joint_recording",
        "with_orientations",
    ),
    "io": (
        "export_motion", "read_recording", "read_solution", "write_recording", "write_solution",
    ),
    "metrics": ("chi_square_band", "coverage", "evaluate", "joint_consistency", "nees", "nis"),
    "motion": (
        "BUILTIN_MOTIONS", "Motion", "ball_jointed", "builtin_motion", "cut_motion", "human",
        "human_like", "load_motion", "load_skeleton", "retarget", "retarget_errors",
        "segment_lengths",
        "with_segment_lengths",
    ),
    "placement": ("PlacementOptions", "PlacementStudy", "place"),
    "pose_prior": (
        "JointLimits", "PosePrior", "default_pose_prior", "learn_joint_limits", "learn_pose_prior",
        "load_pose_prior", "save_pose_prior",
    ),
    "recording": (
        "Calibration", "Recording", "Setup", "calibrated", "cut", "uncalibrated",
        "with_calibration",
    ),
    "report": ("write_animation", "write_report"),
    "simulation": ("SimulationOptions", "simulate"),
    "solution": ("Solution", "Status", "determination", "uncertainty"),
    "trajectory": ("Trajectory",),
}  # fmt: skip
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}

__all__ = ["__version__", *sorted(_MODULE_OF)]


def __getattr__(name: str) -> object:
    """Load a public name on first use (PEP 562)."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'mocap_jax' has no attribute '{name}'")
    value = getattr(import_module(f"mocap_jax.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """All public names, loaded or not."""
    return sorted({*globals(), *__all__})

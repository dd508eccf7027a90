"""Estimators: where recordings, bodies and solvers are wired together."""

from mocap_jax.estimate.absolute_position import absolute_position
from mocap_jax.estimate.check_residual import DerivativeReport, check_residual
from mocap_jax.estimate.contact.options import ContactOptions
from mocap_jax.estimate.derivatives import differentiable, differentiable_ekf
from mocap_jax.estimate.filter import ekf
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.estimate.gravity_options import GravityOptions
from mocap_jax.estimate.joint_axes import joint_axes
from mocap_jax.estimate.joint_limits import joint_limits
from mocap_jax.estimate.magnetic_heading import magnetic_heading
from mocap_jax.estimate.mounting import (
    MountingCalibration,
    SensorMounting,
    calibrate_mounting,
)
from mocap_jax.estimate.orientation_options import OrientationPassOptions
from mocap_jax.estimate.orientation_pass import orientation_pass
from mocap_jax.estimate.range_only import (
    AnchorRanges,
    Odometry,
    RangeOnlyOptions,
    RangeOnlySolution,
    range_only_path,
)
from mocap_jax.estimate.sequence.user_residuals import UserResidual
from mocap_jax.estimate.single_imu import (
    SingleImuOptions,
    SingleImuSolution,
    smooth_orientation,
)
from mocap_jax.estimate.sparse_options import sparse_options, table1_options
from mocap_jax.estimate.unscented_filter import ukf
from mocap_jax.estimate.whole_sequence import optimise
from mocap_jax.estimate.whole_sequence_options import (
    ConstantsOptions,
    NoiseOptions,
    OptimiseOptions,
    PriorOptions,
)

__all__ = [
    "AnchorRanges", "ConstantsOptions", "ContactOptions", "DerivativeReport", "EkfOptions",
    "GravityOptions", "MountingCalibration", "NoiseOptions", "Odometry", "OptimiseOptions",
    "OrientationPassOptions", "PriorOptions", "RangeOnlyOptions", "RangeOnlySolution",
    "SensorMounting", "SingleImuOptions", "SingleImuSolution", "UserResidual", "absolute_position",
    "calibrate_mounting", "check_residual", "differentiable", "differentiable_ekf", "ekf",
    "joint_axes", "joint_limits", "magnetic_heading", "optimise", "orientation_pass",
    "range_only_path", "smooth_orientation", "sparse_options", "table1_options", "ukf",
]  # fmt: skip

"""A path in the plane from travelled distances, turns, and ranges to known anchors."""

from mocap_jax.estimate.range_only.measurements import AnchorRanges, Odometry
from mocap_jax.estimate.range_only.options import RangeOnlyOptions
from mocap_jax.estimate.range_only.path import RangeOnlySolution, range_only_path

__all__ = ["Odometry", "RangeOnlyOptions", "RangeOnlySolution", "AnchorRanges", "range_only_path"]

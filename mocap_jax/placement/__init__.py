"""Where sensors should go: expected errors of a placement, and the search for the best one."""

from mocap_jax.placement.distance import DistanceError
from mocap_jax.placement.export import study_record, write_placement
from mocap_jax.placement.options import (
    Constraints,
    ErrorModel,
    PlacementOptions,
    SearchOptions,
)
from mocap_jax.placement.sources import SourceStudy, choose_sources
from mocap_jax.placement.study import (
    CurvePoint,
    Judge,
    Placement,
    PlacementStudy,
    carrying_segments,
    place,
)

__all__ = [
    "Constraints", "CurvePoint", "DistanceError", "ErrorModel", "Judge", "Placement",
    "PlacementOptions", "PlacementStudy", "SearchOptions", "SourceStudy", "carrying_segments",
    "choose_sources", "place", "study_record", "write_placement",
]  # fmt: skip

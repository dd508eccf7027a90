"""The room around what is worn and what stands in it: floor, ceiling and four walls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.simulation.flight import Emissions
from mocap_jax.simulation.raw.options import RawOptions
from mocap_jax.simulation.rig import Rig, place
from mocap_jax.simulation.spline import PoseSpline

_FLOOR_CLEARANCE = 0.07
"""Of the lowest worn device over the floor: on a foot [m]."""
_FIXED_CLEARANCE = 0.02
"""Of anchors over the floor and below the ceiling at the least [m]."""


@dataclass(frozen=True)
class Room:
    """Planes that reflect, each across an axis of the world at a place [m]."""

    floor: float
    others: tuple[tuple[int, float], ...]
    """Ceiling and walls: axis and place."""


def room_around(
    rig: Rig, spline: PoseSpline, source: np.ndarray, emissions: Emissions, options: RawOptions
) -> Room:
    """The room in which everything has its place.

    Args:
        rig: the true body with its devices.
        spline: its motion.
        source: index of each pulse's source.
        emissions: where these are.
        options: how large the room is.

    Raises:
        InputError: a floor above something worn.
    """
    place(rig, spline.pose(np.array([spline.start]))[0])
    devices = np.concatenate([rig.source_sites, rig.microphone_sites])
    anchors = rig.data.site_xpos[devices[rig.model.site_bodyid[devices] == 0]]
    worn = emissions.origin[rig.model.site_bodyid[rig.source_sites[source]] > 0]
    heights = np.concatenate([rig.data.site_xpos[rig.board_sites][:, 2], worn[:, 2]])
    below = float(heights.min(initial=np.inf)) - _FLOOR_CLEARANCE
    floor = below if options.floor_m is None else options.floor_m
    if options.floor_m is not None:
        hearing = emissions.origin[:, None] + emissions.way
        microphones = hearing[:, rig.model.site_bodyid[rig.microphone_sites] > 0, 2]
        _check_floor(floor, np.concatenate([heights, microphones.ravel()]))
    fixed = anchors[:, 2]
    floor = min(floor, float(fixed.min(initial=np.inf)) - _FIXED_CLEARANCE)
    ceiling = max(floor + options.ceiling_m, float(fixed.max(initial=-np.inf)) + _FIXED_CLEARANCE)
    places = np.concatenate([emissions.origin, anchors])
    low = places.min(axis=0) - options.wall_distance_m
    high = places.max(axis=0) + options.wall_distance_m
    walls = [(axis, float(side[axis])) for axis in (0, 1) for side in (low, high)]
    return Room(floor, ((2, ceiling), *walls))


def _check_floor(floor: float, heights: np.ndarray) -> None:
    """Refuse a floor above any of these heights [m]; raises `InputError`."""
    lowest = float(heights.min(initial=np.inf))
    if floor > lowest:
        raise InputError(
            f"floor_m {floor:g}: above what is worn, which comes down to {lowest:.2f} m; valid are "
            "floors below"
        )

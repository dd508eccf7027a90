"""The constants of a solve by name, as `Solution.calibration` holds them."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from mocap_jax import so3
from mocap_jax.estimate.sequence.layout import (
    CONSTANTS_PER_SENSOR,
    Constants,
    Geometry,
    Layout,
)
from mocap_jax.solution import Solution

_OF_SENSOR = ("gyroscope_bias", "accelerometer_bias", "mounting_rotation", "mounting_offset")


def constant_places(layout: Layout, sensors: tuple[str, ...]) -> dict[str, slice]:
    """Cells of every named constant among all of them.

    Names are `<kind>/<sensor>`, `segment_length/<segment>` (relative change of its offset from the
    parent), `source_position/<source>` [m, site frame], `speed_of_sound/air` (relative change) and
    `source_offset/<source>`, the constant error of its ranges [m].
    """
    topology = layout.topology
    widths = {f"{kind}/{name}": 3 for name in sensors for kind in _OF_SENSOR}
    widths |= {f"segment_length/{topology.body_names[b]}": 1 for b in layout.lengths}
    for place in layout.sources:
        site = topology.site_names[layout.range_sites[place]]
        widths[f"source_position/{site.removeprefix('source/')}"] = 3
    if layout.use_sound:
        widths["speed_of_sound/air"] = 1
    for place in layout.emitters:
        site = topology.site_names[layout.range_sites[place]]
        widths[f"source_offset/{site.removeprefix('source/')}"] = 1
    ends = np.cumsum([0, *widths.values()])
    return {
        name: slice(int(a), int(b)) for name, a, b in zip(widths, ends[:-1], ends[1:], strict=True)
    }


def constants_from(initial: Solution, sensors: tuple[str, ...], layout: Layout) -> Constants:
    """Constants found by an earlier solve; zero where it has none."""
    known = initial.calibration
    look_up = lambda key: np.array(  # noqa: E731
        [np.asarray(known.get(f"{key}/{name}", np.zeros(3))) for name in sensors]
    ).reshape(-1, 3)
    shared = [
        np.ravel(known.get(name, np.zeros(at.stop - at.start)))
        for name, at in constant_places(layout, sensors).items()
        if at.start >= CONSTANTS_PER_SENSOR * len(sensors)
    ]
    flat = np.concatenate([np.zeros(0), *shared])
    length, source, sound, offset = np.split(flat, np.cumsum(layout.geometry_sizes)[:-1])
    return Constants(
        look_up("gyroscope_bias"),
        look_up("accelerometer_bias"),
        np.asarray(so3.exp(jnp.asarray(look_up("mounting_rotation")))),
        look_up("mounting_offset"),
        Geometry(length, source.reshape(-1, 3), sound, offset),
    )

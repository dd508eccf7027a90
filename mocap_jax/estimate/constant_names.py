"""The constants of a solve by name, as `Solution.calibration` holds them."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body.site_names import SOURCE_PREFIX
from mocap_jax.estimate.sequence.constants import Constants, Corrections, Geometry
from mocap_jax.estimate.sequence.layout import Layout
from mocap_jax.estimate.sequence.walk import Walk
from mocap_jax.solution import Solution

_OF_SENSOR = {
    "gyroscope_bias": "gyroscope_bias",
    "accelerometer_bias": "accelerometer_bias",
    "mounting": "mounting_rotation",
    "offset": "mounting_offset",
    "accelerometer_scale": "accelerometer_scale",
    "gyroscope_scale": "gyroscope_scale",
    "clock_offset": "clock_offset",
    "heading": "heading",
    "gyroscope_walk": "gyroscope_bias_walk",
    "accelerometer_walk": "accelerometer_bias_walk",
}
"""Names of the kinds of constants that sensors have."""
_WALKS = ("gyroscope_walk", "accelerometer_walk")


def constant_places(layout: Layout, sensors: tuple[str, ...]) -> dict[str, slice]:
    """Cells of every named constant among all of them.

    Names are `<kind>/<sensor>`, `segment_length/<segment>` (relative change of its offset from the
    parent), `source_position/<source>` [m, site frame], `speed_of_sound/air` (relative change) and
    `source_offset/<source>`, the constant error of its ranges [m]. Cells of `.._bias_walk` are the
    steps from knot to knot (see `walk`).
    """
    topology = layout.topology
    sizes = {kind: size for kind, size in layout.sensor_sizes.items() if size}
    widths = {
        f"{_OF_SENSOR[kind]}/{name}": size for name in sensors for kind, size in sizes.items()
    }
    widths |= {f"segment_length/{topology.body_names[b]}": 1 for b in layout.lengths}
    for place in layout.sources:
        site = topology.site_names[layout.range_sites[place]]
        widths[f"source_position/{site.removeprefix(SOURCE_PREFIX)}"] = 3
    if layout.use_sound:
        widths["speed_of_sound/air"] = 1
    for place in layout.emitters:
        site = topology.site_names[layout.range_sites[place]]
        widths[f"source_offset/{site.removeprefix(SOURCE_PREFIX)}"] = 1
    ends = np.cumsum([0, *widths.values()])
    return {
        name: slice(int(a), int(b)) for name, a, b in zip(widths, ends[:-1], ends[1:], strict=True)
    }


def constants_from(
    initial: Solution, sensors: tuple[str, ...], layout: Layout, walk: Walk | None = None
) -> Constants:
    """Constants found by an earlier solve; zero where it has none."""
    known = initial.calibration

    def look_up(kind: str) -> np.ndarray:
        size, name = layout.sensor_sizes[kind], _OF_SENSOR[kind]
        found = np.zeros((len(sensors), size))
        for i, sensor in enumerate(sensors):
            if size and f"{name}/{sensor}" in known:
                found[i] = _cells(kind, np.asarray(known[f"{name}/{sensor}"]), size, walk)
        return found

    shared = [
        np.ravel(known.get(name, np.zeros(at.stop - at.start)))
        for name, at in constant_places(layout, sensors).items()
        if at.start >= layout.per_sensor * len(sensors)
    ]
    flat = np.concatenate([np.zeros(0), *shared])
    length, source, sound, offset = np.split(flat, np.cumsum(layout.geometry_sizes)[:-1])
    return Constants(
        look_up("gyroscope_bias"),
        look_up("accelerometer_bias"),
        np.asarray(so3.exp(jnp.asarray(look_up("mounting")))),
        look_up("offset"),
        Geometry(length, source.reshape(-1, 3), sound, offset),
        Corrections(**{f.name: look_up(f.name) for f in dataclasses.fields(Corrections)}),
    )


def _cells(kind: str, values: np.ndarray, size: int, walk: Walk | None) -> np.ndarray:
    """A sensor's unknowns of one kind from what `Solution.calibration` says."""
    if kind not in _WALKS or walk is None:
        return np.ravel(values)
    if np.shape(values) != (len(walk.knots), 3):
        return np.zeros(size)
    return np.ravel(np.diff(values, axis=0) / np.sqrt(np.diff(walk.knots)[:, None]))


def calibration(
    layout: Layout,
    sensors: tuple[str, ...],
    values: Float[np.ndarray, "m"],
    covariance: Float[np.ndarray, "m m"] | None,
    walk: Walk | None = None,
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Constants by name and their standard deviations (NaN where the covariance is unknown).

    Of a bias that walks `.._bias` is the mean over the recording and `.._bias_walk` (n, 3) its
    values at the knots.
    """
    places = constant_places(layout, sensors)
    known, deviation = {}, {}
    for name, at in places.items():
        kind, _, sensor = name.partition("/")
        known[name] = values[at]
        square = None if covariance is None else covariance[at, at]
        if walk is not None and kind.endswith("_bias_walk"):
            mean = places[f"{kind.removesuffix('_walk')}/{sensor}"]
            # The values at the knots are this times the mean, then the steps.
            rows = np.kron(np.hstack([np.ones((len(walk.knots), 1)), walk.at_knots]), np.eye(3))
            cells = np.r_[mean, at]
            known[name] = (rows @ values[cells]).reshape(-1, 3)
            square = (
                None if covariance is None else rows @ covariance[np.ix_(cells, cells)] @ rows.T
            )
        root = np.full(known[name].size, np.nan) if square is None else np.sqrt(np.diag(square))
        deviation[name] = root.reshape(known[name].shape)
    return known, deviation

"""`Constants`: the unknowns of a whole-sequence problem that do not change with time."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import jax
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.estimate.sequence.layout import Layout


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Geometry:
    """Constants of body, sources and air: what ranges measure poses by."""

    length: Float[Array, "l"] = field(default_factory=lambda: np.zeros(0))
    """Relative change of the distance of each of `Layout.lengths` from its parent."""
    source: Float[Array, "n 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    """Position of each of `Layout.sources` less that of its site, site frame [m]."""
    sound: Float[Array, "u"] = field(default_factory=lambda: np.zeros(0))
    """Relative change of the speed of sound; empty where it is certain."""
    range_offset: Float[Array, "e"] = field(default_factory=lambda: np.zeros(0))
    """Constant error of the ranges of each of `Layout.emitters` [m]."""


def _none() -> np.ndarray:
    return np.zeros((0, 0))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Corrections:
    """Further errors of boards; those that `Layout` does not name have no columns."""

    accelerometer_scale: Float[Array, "s a"] = field(default_factory=_none)
    """Relative errors of the scale of the axes: a reading is (1 + scale) times the truth."""
    gyroscope_scale: Float[Array, "s b"] = field(default_factory=_none)
    clock_offset: Float[Array, "s c"] = field(default_factory=_none)
    """What a board's stamps say less the time of root and ranges [s]."""
    heading: Float[Array, "s d"] = field(default_factory=_none)
    """Rotation of the measured orientations about the world's vertical [rad]."""
    gyroscope_walk: Float[Array, "s e"] = field(default_factory=_none)
    """Steps of the bias from knot to knot, one after another, over the root of the time between
    knots [rad/s/sqrt(s)] (see `walk`)."""
    accelerometer_walk: Float[Array, "s f"] = field(default_factory=_none)
    """[m/s^2/sqrt(s)]"""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Constants:
    """The unknowns that do not change over the sequence."""

    gyroscope_bias: Float[Array, "s 3"]
    """[rad/s]"""
    accelerometer_bias: Float[Array, "s 3"]
    """[m/s^2]"""
    mounting: Float[Array, "s 3 3"]
    """R_site_sensor."""
    offset: Float[Array, "s 3"]
    """Position of the sensor less that of its site, site frame [m]."""
    geometry: Geometry = field(default_factory=Geometry)
    corrections: Corrections = field(default_factory=Corrections)


def no_errors(layout: Layout) -> Constants:
    """Constants of a perfect set-up."""
    s = len(layout.sites)
    of_kind = {kind: np.zeros((s, size)) for kind, size in layout.sensor_sizes.items()}
    lengths, sources, sound, emitters = (np.zeros(n) for n in layout.geometry_sizes)
    return Constants(
        of_kind["gyroscope_bias"],
        of_kind["accelerometer_bias"],
        np.tile(np.eye(3), (s, 1, 1)),
        of_kind["offset"],
        Geometry(lengths, sources.reshape(-1, 3), sound, emitters),
        Corrections(**{f.name: of_kind[f.name] for f in dataclasses.fields(Corrections)}),
    )

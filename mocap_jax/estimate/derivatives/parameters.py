"""`Parameters`: what an estimate is differentiated by, and what the problem's arrays are of it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float

from mocap_jax import so3
from mocap_jax.body import Body, floating_dofs, joint_dofs
from mocap_jax.estimate.derivatives.averaging import de_averaged, interval_means
from mocap_jax.estimate.sequence.layout import Layout, Terms
from mocap_jax.estimate.sequence.levels import INFORMATION, KINDS, constant_cells
from mocap_jax.residuals.inertial import CONSISTENT


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Measurements:
    """Readings on the frame grid; zero where missing (missing ones stay missing)."""

    accelerometer: Float[Array, "t s 3"]
    """[m/s^2]"""
    gyroscope: Float[Array, "t s 3"]
    """[rad/s]"""
    orientation: Float[Array, "t s 4"]
    """R_world_sensor as quaternions wxyz, normalised on use."""
    range_distance: Float[Array, "t k"]
    """[m]"""
    root_position: Float[Array, "t 3"]
    """[m]"""
    root_orientation: Float[Array, "t 4"]
    """wxyz, normalised on use."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Figures:
    """Standard deviations and densities (names and units as in `NoiseFigures`, `PriorOptions` and
    `ConstantsOptions`)."""

    accelerometer: Float[Array, ""]
    gyroscope: Float[Array, ""]
    orientation: Float[Array, ""]
    range: Float[Array, ""]
    root_position: Float[Array, ""]
    root_orientation: Float[Array, ""]
    smoothness_density: Float[Array, ""]
    shared_smoothness_density: Float[Array, ""]
    translation_density: Float[Array, ""]
    pose_sigma: Float[Array, ""]
    limit_sigma: Float[Array, ""]
    rest_sigma: Float[Array, ""]
    """This and the following as the estimator ended up using them."""
    gyroscope_bias_sigma: Float[Array, ""]
    accelerometer_bias_sigma: Float[Array, ""]
    mounting_sigma: Float[Array, ""]
    offset_sigma: Float[Array, ""]
    length_sigma: Float[Array, ""]
    source_sigma: Float[Array, ""]
    sound_sigma: Float[Array, ""]
    range_offset_sigma: Float[Array, ""]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class SensorWeights:
    """Factors of the information of each sensor's readings, 1 at first; 0 switches a sensor off."""

    accelerometer: Float[Array, "s"]
    gyroscope: Float[Array, "s"]
    orientation: Float[Array, "s"]
    range: Float[Array, ""]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ModelErrors:
    """Shares of the model errors (see `NoiseOptions`) that the estimator ended up using."""

    accelerometer: Float[Array, "s"]
    gyroscope: Float[Array, "s"]
    orientation: Float[Array, "s"]
    range: Float[Array, "1"]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Parameters:
    """All that an estimate can be differentiated by."""

    measurements: Measurements
    figures: Figures
    weights: SensorWeights
    model_errors: ModelErrors
    body: Body
    """Segment offsets (`body_pos`), mountings (`site_pos`, `site_quat`), joint axes and limits."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Fixed:
    """What stays as it was at the solution: base values, robust gates, which readings exist."""

    base: Parameters
    terms: Terms
    """With the final information, of t frames."""
    declared: dict[str, Array]
    """Kind -> declared variances, 1 where absent."""
    model: dict[str, Array]
    """Kind -> variances of full model errors, 0 where absent."""
    known: dict[str, Bool[Array, "t s 3"]]
    smoothness_kind: Array
    """Of each degree of freedom (nv,): 0 joint, 1 shared joint, 2 translation, 3 board on skin."""
    root_known: Bool[Array, "t"]
    rest_frames: Bool[Array, "t"]
    """Frames of the rest hold whose gyroscopes tell the bias."""
    prior_information: Float[Array, "m"]
    readings: tuple[Float[Array, "m"], Float[Array, "m"]]


_SMOOTHNESS = ("smoothness_density", "shared_smoothness_density", "translation_density")


def terms_of(layout: Layout, fixed: Fixed, p: Parameters, sound: Array, step: Array) -> Terms:
    """The problem's arrays under other parameters; those of `fixed.base` give `fixed.terms`.

    Args:
        layout: shape of the problem.
        fixed: what stays.
        p: parameters.
        sound: declared speed of sound [m/s].
        step: time between frames [s].
    """
    known, m = fixed.known, p.measurements
    consistent = layout.force_weights == CONSISTENT
    force = de_averaged(m.accelerometer, known["accelerometer"]) if consistent else m.accelerometer
    rate = de_averaged(m.gyroscope, known["gyroscope"])
    changes = {
        "force": force,
        "rate": rate,
        "mean_rate": interval_means(rate, known["gyroscope"]),
        "orientation": so3.quat_to_matrix(so3.quat_normalise(m.orientation)),
        "range_distance": m.range_distance,
        "range_flight": m.range_distance / sound / step,
        "smoothness_information": _smoothness(fixed, p),
        "limit_information": fixed.terms.limit_information
        * (fixed.base.figures.limit_sigma / p.figures.limit_sigma) ** 2,
        "reference": _reference(layout, fixed, p),
        "reference_information": _reference_information(layout, fixed, p),
    }
    changes |= {INFORMATION[kind]: _information(kind, fixed, p) for kind in KINDS}
    return dataclasses.replace(fixed.terms, **changes)


def _information(kind: str, fixed: Fixed, p: Parameters) -> Array:
    """Final information of one kind, scaled by the change of its variance and by its weights."""

    def variance(q: Parameters) -> Array:
        ratio = getattr(q.figures, kind) / getattr(fixed.base.figures, kind)
        share = getattr(q.model_errors, kind)
        return fixed.declared[kind] * ratio**2 + share**2 * fixed.model[kind]

    info = getattr(fixed.terms, INFORMATION[kind])
    return info * variance(fixed.base) / variance(p) * getattr(p.weights, kind)


def _smoothness(fixed: Fixed, p: Parameters) -> Array:
    def of(q: Parameters) -> Array:
        # Displacements of boards have a density of their own, which is no parameter.
        return jnp.stack([*(getattr(q.figures, name) for name in _SMOOTHNESS), jnp.ones(())])

    return fixed.terms.smoothness_information * (of(fixed.base) / of(p))[fixed.smoothness_kind]


def _has_root(layout: Layout) -> bool:
    return layout.topology.joint_types[0] == "free"


def _reference(layout: Layout, fixed: Fixed, p: Parameters) -> Array:
    """Reference poses; the measured root where it is known."""
    reference, m = fixed.terms.reference, p.measurements
    if not _has_root(layout):
        return reference
    root = jnp.concatenate([m.root_position, so3.quat_normalise(m.root_orientation)], axis=1)
    kept = jnp.where(fixed.root_known[:, None], root, reference[0, :, :7])
    return reference.at[0, :, :7].set(kept)


def _reference_information(layout: Layout, fixed: Fixed, p: Parameters) -> Array:
    base, f = fixed.base.figures, p.figures
    square = lambda name: (getattr(base, name) / getattr(f, name)) ** 2  # noqa: E731
    nv, first = layout.topology.nv, 6 if _has_root(layout) else 0
    root = jnp.repeat(jnp.stack([square("root_position"), square("root_orientation")]), 3)[:first]
    # Where the root was not measured, what holds it still is no root measurement.
    rooted = jnp.full((len(fixed.root_known), nv), square("rest_sigma"))
    rooted = rooted.at[:, :first].set(jnp.where(fixed.root_known[:, None], root, 1.0))
    if (further := layout.topology.root_dofs[first:]).any():
        rooted = rooted.at[:, first + np.flatnonzero(further)].set(1.0)
    weak = jnp.ones(rooted.shape).at[:, joint_dofs(layout.topology)].set(square("pose_sigma"))
    return fixed.terms.reference_information * jnp.stack([rooted, weak])


def constants_prior(
    layout: Layout, fixed: Fixed, p: Parameters
) -> tuple[Array, tuple[Array, Array]]:
    """Inverse variances (m,) of the constants, and readings of them with theirs."""
    prior, (values, sure) = fixed.prior_information, fixed.readings
    if not layout.use_border:
        return prior, (values, sure)
    cells = constant_cells(layout)
    for name, at in cells.items():
        if not len(at):
            continue
        before, now = (getattr(x.figures, f"{name}_sigma") for x in (fixed.base, p))
        # A constant that is pinned stays so.
        safe = jnp.where(before > 0, now, 1.0)
        ratio = jnp.where(before > 0, before / safe, 1.0)
        prior = prior.at[at].set(prior[at] * ratio**2)
    moved = p.measurements.gyroscope - fixed.base.measurements.gyroscope
    held = fixed.rest_frames[:, None, None] & fixed.known["gyroscope"]
    mean = jnp.where(held, moved, 0.0).sum(0) / jnp.maximum(held.sum(0), 1)
    return prior, (values.at[cells["gyroscope_bias"]].add(mean.ravel()), sure)


def smoothness_kinds(body: Body, shared: np.ndarray) -> np.ndarray:
    """Which density each degree of freedom has (nv,), see `Fixed.smoothness_kind`."""
    kind = np.where(shared, 1, 0)
    topology = body.topology
    for j, joint in enumerate(topology.joint_types):
        if joint in ("slide", "free"):
            first = topology.joint_dof[j]
            kind[first : first + (3 if joint == "free" else 1)] = 2
    kind[floating_dofs(body)] = 3
    return kind

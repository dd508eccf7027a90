"""From measurements on the frame grid to the arrays of a whole-sequence problem."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mocap_jax import so3
from mocap_jax.body import Body, site_segments
from mocap_jax.errors import InputError
from mocap_jax.estimate.contact.contacts import Contacts
from mocap_jax.estimate.free_roots import FreeRoot, free_roots
from mocap_jax.estimate.gravity_reference import GravityReference, gravity_reference
from mocap_jax.estimate.magnetic_heading import MagneticReadings, sequence_headings
from mocap_jax.estimate.measured_rotation import uses_measured_rotation, where_turned
from mocap_jax.estimate.sequence.corrections import correction_fields, slope_terms, walk_of
from mocap_jax.estimate.sequence.coupled import coupled_coordinates
from mocap_jax.estimate.sequence.knees import knee_hinges
from mocap_jax.estimate.sequence.layout import NO_GROUND, NO_PRIOR, Layout, Terms, Weights
from mocap_jax.estimate.sequence.pose_information import pose_fields, rest_frames
from mocap_jax.estimate.sequence.pose_prior_terms import OnBody, on_body
from mocap_jax.estimate.sequence.user_residuals import (
    UserResidual,
    check_names,
    data_of,
    mask_of,
)
from mocap_jax.estimate.sequence.variances import Variances, variances
from mocap_jax.estimate.sequence.walk import Walk
from mocap_jax.estimate.whole_sequence_options import ConstantsOptions, OptimiseOptions
from mocap_jax.initialise import declared_pose
from mocap_jax.measurement import FrameData
from mocap_jax.recording import Setup
from mocap_jax.residuals.inertial import CONSISTENT, PLAIN, de_average, mean_rate

# Joints closer together than this have no length between them [m].
_SHORTEST = 1e-3


@dataclass(frozen=True)
class Built:
    """A problem's static layout and its arrays."""

    layout: Layout
    terms: Terms
    weights: Weights
    rest_frames: np.ndarray
    """Frames of the declared rest hold."""
    variances: Variances
    walk: Walk | None = None
    """How biases walk; None where they stay."""
    contacts: Contacts | None = None
    """Feet that stand; None where they are not looked for."""
    roots: tuple[FreeRoot, ...] = ()
    """Roots of the people in the body."""
    remarks: tuple[str, ...] = ()
    """What a solution is to say of the problem."""


def build(
    data: FrameData,
    body: Body,
    setup: Setup,
    options: OptimiseOptions,
    *,
    root_given: bool,
    user_data: tuple = (),
    inertial: FrameData | None = None,
    magnetic: MagneticReadings | None = None,
) -> Built:
    """Assemble layout, terms and weights.

    Args:
        data: measurements on the frame grid.
        body: the body.
        setup: declared noise, rest hold and speed of sound.
        options: options of the optimiser.
        root_given: use the measured root pose.
        user_data: per user residual, a pytree of arrays with one row a frame (or None).
        inertial: accelerometers and gyroscopes of the same frames for `options.gravity`, where
            `data` leaves them out; default `data`.
        magnetic: what magnetometers read, on the same frames.

    Raises:
        InputError: no measurement of the kinds chosen, no root pose where it is given, or options
            that are not valid or that the measurements do not serve.
    """
    knees, knee_data = knee_hinges(body, len(data.time), options)
    coupled, coupled_data = coupled_coordinates(body, len(data.time))
    headings, heading_data = sequence_headings(magnetic, float(data.step), options)
    check_names((*options.user_residuals, *headings))
    user = (*options.user_residuals, *headings, *knees, *coupled)
    usual = on_body(body, options.pose_prior, options.prior.share_sigma)
    rest = rest_frames(data, setup)
    roots = free_roots(data, body.topology, root_given=root_given)
    contacts = _contacts(data, body, setup, options, rest, root_given=root_given)
    gravity = _gravity(data if inertial is None else inertial, body, options)
    layout = _layout(data, body, options, user, usual, contacts)
    walking = walk_of(data, layout.gyroscope_steps, layout.accelerometer_steps)
    readings = _inertial(data, options)
    terms = Terms(
        **_readings(data, setup, readings, layout),
        **pose_fields(data, body, setup, options, rest, usual, roots),
        user_data=(
            *data_of(options.user_residuals, user_data),
            *heading_data,
            *knee_data,
            *coupled_data,
        ),
        user_mask=tuple(mask_of(r, len(data.time)) for r in user),
        walk=(walking.at_frames,) if walking else (),
        contact=contacts.none if contacts else (),
        gravity=(gravity.force, gravity.information) if gravity else (),
    )
    weights = _weights(options, float(data.step), usual, contacts, gravity)
    variance = _variances(data, setup, options, readings, layout)
    remarks = (gravity.remark,) if gravity else ()
    return Built(layout, terms, weights, rest, variance, walking, contacts, roots, remarks)


def _gravity(data: FrameData, body: Body, options: OptimiseOptions) -> GravityReference | None:
    return None if options.gravity is None else gravity_reference(data, body, options.gravity)


class _Inertial(NamedTuple):
    """De-averaged readings (t, s, 3)."""

    force: np.ndarray
    rate: np.ndarray
    mean_rate: np.ndarray
    """Of intervals."""


def _inertial(data: FrameData, options: OptimiseOptions) -> _Inertial:
    rate = de_average(np.asarray(data.gyroscope))
    return _Inertial(_forces(data, options), rate, mean_rate(rate))


def _readings(data: FrameData, setup: Setup, inertial: _Inertial, layout: Layout) -> dict[str, Any]:
    """Fields of `Terms` that hold measurements; inertial ones are not weighted yet."""
    out: dict[str, Any] = _ranges(data, setup, layout, float(data.step)) | {
        f"{name}_information": np.zeros(inertial.force.shape[:2])
        for name in ("force", "rate", "orientation")
    }
    if layout.use_clock_offset:
        out |= slope_terms(inertial.force, inertial.rate, float(data.step), setup.noise)
    return out | {
        **{name: np.nan_to_num(value) for name, value in inertial._asdict().items()},
        "orientation": _rotations(np.asarray(data.orientation)),
    }


def _weights(
    options: OptimiseOptions, step: float, usual: OnBody | None, contacts: Contacts | None,
    gravity: GravityReference | None,
) -> Weights:  # fmt: skip
    return Weights(
        np.asarray(step),
        np.asarray(options.noise.inertial_scale),
        np.asarray(options.noise.range_scale),
        np.asarray(1.0),
        np.asarray(options.prior.limit_softness),
        NO_PRIOR if usual is None else usual.gaussian,
        NO_GROUND if contacts is None else contacts.ground(0.0, 1.0),
        np.asarray(1.0 if gravity is None else gravity.scale),
    )


def _variances(
    data: FrameData, setup: Setup, options: OptimiseOptions, inertial: _Inertial, layout: Layout
) -> Variances:
    variance = variances(data, inertial.force, inertial.mean_rate, setup.noise, options.noise)
    if layout.use_clock_offset:
        # The rate that moves a predicted orientation in time needs a frame on either side.
        variance["orientation"][0][[0, -1]] = np.inf
    if layout.measured_rotation:
        declared, model = variance["accelerometer"]
        variance["accelerometer"] = where_turned(declared, data, layout.force_weights), model
    return variance


def _contacts(
    data: FrameData, body: Body, setup: Setup, options: OptimiseOptions, rest: np.ndarray, *,
    root_given: bool,
) -> Contacts | None:  # fmt: skip
    if options.contacts is None:
        return None
    standing = declared_pose(setup.rest, body)
    return Contacts(data, body, standing, options.contacts, rest, root_given=root_given)


def _layout(
    data: FrameData, body: Body, options: OptimiseOptions, user: tuple[UserResidual, ...],
    usual: OnBody | None, contacts: Contacts | None,
) -> Layout:  # fmt: skip
    present = np.asarray(data.range_weight) > 0
    used = np.unique(
        np.concatenate(
            [np.asarray(data.range_source)[present], np.asarray(data.range_receiver)[present]]
        )
    )
    c = options.constants
    inertial = np.isfinite(np.asarray(data.accelerometer)).any()
    rates = np.isfinite(np.asarray(data.gyroscope)).any()
    orientations = np.isfinite(np.asarray(data.orientation)).any()
    if not (inertial or rates or orientations or len(used)):
        raise InputError(
            f"no measurement of the kinds '{options.kinds}' in the recording "
            "(A accelerometer, G gyroscope, D distance, O orientation)"
        )
    corrections = correction_fields(data, c)
    border = bool(data.sites) and any(
        (
            c.gyroscope_bias_sigma, c.accelerometer_bias_sigma, c.mounting_sigma, c.offset_sigma,
            *corrections.values(),
        )
    )  # fmt: skip
    range_sites = tuple(int(s) for s in used)
    return Layout(
        topology=body.topology,
        sites=tuple(data.sites),
        range_sites=range_sites,
        root_body=1,
        use_acceleration=bool(inertial),
        use_rate=bool(rates),
        use_orientation=bool(orientations),
        use_range=bool(len(used)),
        use_border=border,
        force_weights=CONSISTENT if options.stencil == "consistent" else PLAIN,
        smoothness_order=options.prior.smoothness_order,
        inertial_loss=options.noise.inertial_loss,
        range_loss=options.noise.range_loss,
        user=user,
        chunk=options.chunk,
        pose_joints=() if usual is None else usual.joints,
        measured_rotation=uses_measured_rotation(data, options),
        use_gravity=options.gravity is not None,
        gravity_loss="none" if options.gravity is None else options.gravity.loss,
        **({} if contacts is None else contacts.fields),  # type: ignore[arg-type]
        **(_geometry(data, body, range_sites, c) if border and len(used) else {}),  # type: ignore[arg-type]
        **(corrections if border else {}),  # type: ignore[arg-type]
    )


def _geometry(
    data: FrameData, body: Body, range_sites: tuple[int, ...], options: ConstantsOptions
) -> dict[str, object]:
    """Unknown lengths, sources, speed of sound and range offsets, as fields of `Layout`."""
    topology, sensors = body.topology, data.sites
    out: dict[str, object] = {"use_sound": options.sound_sigma > 0}
    emit = np.unique(np.asarray(data.range_source)[np.asarray(data.range_weight) > 0])
    if options.source_sigma > 0:
        # A source on the world is an anchor: its place was measured.
        worn = [s in emit and s not in sensors and topology.site_body[s] > 0 for s in range_sites]
        out["sources"] = tuple(i for i, loose in enumerate(worn) if loose)
    if options.range_offset_sigma > 0:
        out["emitters"] = tuple(i for i, s in enumerate(range_sites) if s in emit)
    if options.length_sigma > 0:
        moved, segments = {0}, site_segments(topology)
        for site in (*sensors, *range_sites):
            b = segments[site]
            while b not in moved:
                moved.add(b)
                b = topology.body_parent[b]
        length = np.linalg.norm(np.asarray(body.body_pos), axis=1)
        out["lengths"] = tuple(b for b in sorted(moved) if b > 1 and length[b] > _SHORTEST)
    return out


def _forces(data: FrameData, options: OptimiseOptions) -> np.ndarray:
    """De-averaged specific forces (t, s, 3)."""
    measured = np.asarray(data.accelerometer)
    return de_average(measured) if options.stencil == "consistent" else measured


def _rotations(quaternions: np.ndarray) -> np.ndarray:
    known = np.isfinite(quaternions).all(axis=-1, keepdims=True)
    return np.asarray(so3.quat_to_matrix(np.where(known, quaternions, [1.0, 0.0, 0.0, 0.0])))


def _ranges(data: FrameData, setup: Setup, layout: Layout, step: float) -> dict[str, np.ndarray]:
    place = np.zeros(max([*layout.range_sites, 0]) + 1, int)
    place[list(layout.range_sites)] = np.arange(len(layout.range_sites))
    weight = np.asarray(data.range_weight)
    present = weight > 0
    look_up = lambda sites: np.where(present, place[np.where(present, sites, 0)], 0)  # noqa: E731
    distance = np.where(present, np.asarray(data.range_distance), 0.0)
    return {
        "range_distance": distance,
        "range_information": np.zeros_like(weight),
        "range_source": look_up(np.asarray(data.range_source)),
        "range_receiver": look_up(np.asarray(data.range_receiver)),
        "range_lead": np.asarray(data.range_lead),
        "range_flight": distance / setup.speed_of_sound / step,
    }

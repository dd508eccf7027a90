"""What is assumed about poses frame by frame: references, smoothness, movement of the skin."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from mocap_jax.body import Body, floating_dofs, joint_dofs
from mocap_jax.errors import InputError
from mocap_jax.estimate.free_roots import FreeRoot
from mocap_jax.estimate.sequence.pose_prior_terms import OnBody
from mocap_jax.estimate.shared_joints import shared_joints
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions, PriorOptions
from mocap_jax.initialise import declared_pose
from mocap_jax.measurement import FrameData
from mocap_jax.recording import Setup

# The frame-by-frame root hold of a still person during the declared rest [m], [rad].
_STILL = 0.005
# How far a root may be from its declared place where ranges tell [m], [rad].
_GUESS = 1.0, 0.3


def rest_frames(data: FrameData, setup: Setup) -> np.ndarray:
    """Frames of the declared rest hold."""
    if setup.rest is None:
        return np.zeros(0, int)
    time = np.asarray(data.time)
    return np.flatnonzero((time >= setup.rest.start) & (time <= setup.rest.end))


def pose_fields(
    data: FrameData, body: Body, setup: Setup, options: OptimiseOptions, rest: np.ndarray,
    usual: OnBody | None, roots: tuple[FreeRoot, ...],
) -> dict[str, Any]:  # fmt: skip
    """Fields of `Terms` that say what is assumed about poses.

    Args:
        data: measurements on the frame grid.
        body: the body.
        setup: declared noise and rest hold.
        options: of the optimiser.
        rest: frames of the declared rest hold.
        usual: the pose prior on this body.
        roots: of the body.
    """
    step, frames = float(data.step), len(data.time)
    inside = np.zeros(body.nv, bool) if usual is None else usual.inside
    reference, information = references(data, body, setup, options, rest, inside, roots)
    limit = step / options.prior.limit_sigma**2 if options.prior.limits else 0.0
    return {
        "reference": reference,
        "reference_information": information,
        "smoothness_information": _smoothness(data, body, options),
        "limit_information": np.full(frames, limit),
        "pose_information": _pose_information(data, rest, usual),
        "pace_information": np.append(np.full(frames - 1, 1 / step), 0.0),
    }


def references(
    data: FrameData,
    body: Body,
    setup: Setup,
    options: OptimiseOptions,
    rest: np.ndarray,
    usual: np.ndarray,
    roots: tuple[FreeRoot, ...],
) -> tuple[np.ndarray, np.ndarray]:
    """Reference poses (2, t, nq) and their information (2, t, nv).

    The first are the measured root and the declared rest pose, the second is the weak prior. It
    leaves joints to the pose prior that have one (mask `usual`, nv). The declared place of a root
    that nothing says more of is held while the person is still; where ranges do, it is a guess.
    """
    t, nv = len(data.time), body.nv
    declared = declared_pose(setup.rest, body)
    reference = np.tile(declared, (2, t, 1))
    information = np.zeros((2, t, nv))
    joints = joint_dofs(body.topology)
    prior = options.prior
    if len(rest):
        information[0, rest[:, None], joints] = 1 / (prior.rest_sigma**2 * len(rest))
    information[1][:, joints] = float(data.step) / prior.pose_sigma**2
    information[1][:, usual] = 0.0
    information[1][:, floating_dofs(body)] = float(data.step) / _skin(prior).size
    still = rest if len(rest) else np.arange(2)
    for root in roots:
        if root.tie == "measured":
            _put_root(reference[0], information[0], data, setup)
        else:
            information[0][still, root.first_v : root.first_v + 6] = _hold(root, len(still))
    return reference, information


def _hold(root: FreeRoot, frames: int) -> np.ndarray:
    """Information (6,) that each of the still frames has of a root's declared place."""
    if not root.by_ranges:
        return np.full(6, 1 / _STILL**2)
    return np.repeat([1 / (sigma**2 * frames) for sigma in _GUESS], 3)


def _put_root(
    reference: np.ndarray, information: np.ndarray, data: FrameData, setup: Setup
) -> None:
    """Measured root poses; a system that measures positions alone leaves orientations NaN."""
    position, quat = np.asarray(data.root_position), np.asarray(data.root_orientation)
    there, turned = (np.isfinite(x).all(1) for x in (position, quat))
    if not (there | turned).any():
        raise InputError("root 'given', but the recording has no root pose; valid: --root free")
    # Between known frames the nearest stands in; its information is zero.
    if there.any():
        reference[:, :3] = position[_nearest(there)]
    if turned.any():
        reference[:, 3:7] = quat[_nearest(turned)]
    information[:, :3] = there[:, None] / setup.noise.root_position**2
    information[:, 3:6] = turned[:, None] / setup.noise.root_orientation**2


def _nearest(known: np.ndarray) -> np.ndarray:
    """The nearest known frame to each frame (t,), the earlier one of two."""
    at, frames = np.flatnonzero(known), np.arange(len(known))
    after = np.searchsorted(at, frames).clip(0, len(at) - 1)
    before = (after - 1).clip(0)
    return np.where(frames - at[before] <= np.abs(at[after] - frames), at[before], at[after])


def _smoothness(data: FrameData, body: Body, options: OptimiseOptions) -> np.ndarray:
    """Information of second or third differences, zero where the window leaves the sequence."""
    prior, step = options.prior, float(data.step)
    shared = shared_joints(body, tuple(data.sites))
    density = np.where(shared, prior.shared_smoothness_density, prior.smoothness_density)
    topology = body.topology
    for j, kind in enumerate(topology.joint_types):
        if kind in ("slide", "free"):
            first = topology.joint_dof[j]
            density[first : first + (3 if kind == "free" else 1)] = prior.translation_density
    density[floating_dofs(body)] = _skin(prior).density
    information = np.tile(step / density, (len(data.time), 1))
    information[0] = 0.0
    information[-1:] = 0.0
    if prior.smoothness_order == 3:
        information[-2:] = 0.0
    return information


class _Skin(NamedTuple):
    """Prior of a board's displacement: spectrum 1 / (1 / size + omega^4 / density)."""

    size: float
    """[m^2 s]"""
    density: float
    """Of its acceleration [m^2/s^3]."""


def _skin(prior: PriorOptions) -> _Skin:
    """Figures that give the displacement its deviation, up to the corner frequency."""
    corner = 2 * np.pi * prior.skin_frequency
    # The integral of 1 / (1 + x^4) over all x, divided by 2 pi, is 1 / sqrt 8.
    size = np.sqrt(8.0) * max(prior.skin_sigma, 1e-6) ** 2 / corner
    return _Skin(size, size * corner**4)


def _pose_information(data: FrameData, rest: np.ndarray, usual: OnBody | None) -> np.ndarray:
    """How many independent poses each frame counts as; in the rest hold the pose is declared."""
    count = 0.0 if usual is None else float(data.step) / usual.correlation_time
    information = np.full(len(data.time), count)
    information[rest] = 0.0
    return information

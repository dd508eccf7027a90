"""`worn_in_rest_pose`: the boards of a recording on a body whose segments have other frames."""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax import so3
from mocap_jax.body import Body, load_body
from mocap_jax.body.site_names import SOURCE_PREFIX
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.initialise.declared_pose import declared_pose
from mocap_jax.motion import Motion, retarget, xsens_name
from mocap_jax.recording import Recording, RestHold
from mocap_jax.solution.poses import segment_poses
from mocap_jax.trajectory import Trajectory


def worn_in_rest_pose(recording: Recording, body: Body) -> tuple[Recording, Body]:
    """Put a recording's boards and sources on another body, such as one of `load_skeleton`.

    The declared rest pose is retargeted. In it every board keeps its orientation in the world, and
    its offset from the joint of its segment, scaled by leg length. Sites that the body has already
    stay. Person and anchors stand in the world where they stood.

    Args:
        recording: with its own body, whose sites carry the boards.
        body: with a free root and the boards' segments by name (Xsens, CMU or BVH names).

    Returns:
        The recording with the rest pose of that body, and the body with a site for every board.

    Raises:
        InputError: no body in the recording, a segment that the other body lacks, or bodies that do
            not correspond.
    """
    from mocap_jax.simulation import Mounting, Suit, mount  # slow to load
    from mocap_jax.simulation.mounting import standing_anchors

    if recording.body_xml is None:
        raise InputError("the recording has no body (body.xml) to take its boards' places from")
    own = load_body(recording.body_xml)
    own_q = declared_pose(recording.setup.rest, own)
    q, scale = _same_pose(own, own_q, body)
    (R_own, _), (R_new, _) = segment_poses(own, own_q[None]), segment_poses(body, q[None])
    segments = {xsens_name(n): b for b, n in enumerate(body.topology.body_names) if b}
    boards: list[Mounting] = []
    sources: list[Mounting] = []
    for site, device in enumerate(own.topology.site_names):
        old = own.topology.site_body[site]
        if old == 0 or device in body.topology.site_names:  # in the room, or there
            continue
        name = xsens_name(own.topology.body_names[old])
        if name not in segments:
            raise unknown_name(f"segment for '{device}':", name, segments)
        new = segments[name]
        R_new_old = R_new[0, new].T @ R_own[0, old]
        R_old_site = np.asarray(so3.quat_to_matrix(own.site_quat[site]))
        orientation = np.asarray(so3.quat_from_matrix(R_new_old @ R_old_site))
        position = scale * R_new_old @ np.asarray(own.site_pos[site])
        (sources if device.startswith(SOURCE_PREFIX) else boards).append(
            Mounting(
                device.removeprefix(SOURCE_PREFIX), body.topology.body_names[new],
                tuple(position.tolist()), tuple(orientation.tolist()),
            )
        )  # fmt: skip
    more = [name for name in own.topology.site_names if name not in body.topology.site_names]
    suit = Suit(tuple(boards), tuple(sources), anchors=standing_anchors(own, more))
    carrier = mount(body, suit)
    rest = recording.setup.rest
    if rest is not None:
        rest = RestHold(rest.start, rest.end, carrier.topology.by_joint(q))
    setup = dataclasses.replace(recording.setup, rest=rest)
    return dataclasses.replace(recording, setup=setup, body_xml=carrier.xml), carrier


def _same_pose(own: Body, own_q: np.ndarray, body: Body) -> tuple[np.ndarray, float]:
    """The pose of another body at the same place, and its leg length over the first one's."""
    at_origin, place = own_q.copy(), np.zeros(2)
    if own.has_free_root:
        # Retargeting scales paths: a path that begins elsewhere than at the origin is moved.
        place, at_origin[:2] = own_q[:2], 0.0
    still = Trajectory(np.arange(4) / 60.0, np.tile(at_origin, (4, 1)))
    fitted = retarget(Motion("rest", own, still, {}), body)
    q = np.array(fitted.trajectory.q)[0]
    q[:2] += place
    return q, float(fitted.facts["scale"])

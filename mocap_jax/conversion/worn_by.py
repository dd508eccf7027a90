"""`worn_by`: a recording's sensors on another body."""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.body import Body, load_body
from mocap_jax.conversion.mounted import mounted
from mocap_jax.errors import InputError
from mocap_jax.io.convert import Worn
from mocap_jax.motion import XSENS_SEGMENTS, segment_lengths
from mocap_jax.recording import Recording

# Segment frames of two bodies are taken for the same within this.
_SAME = 1e-6


def worn_by(recording: Recording, body: Body) -> Recording:
    """The recording with its sensors and sources worn by another body, which it then holds.

    A body that has a site for each of them keeps its sites. Otherwise, what the recording's own
    body wears goes to the same segments of the other one, nearer to or farther from their joints
    as these are shorter or longer; this is for bodies of `human`, whose segment frames agree. The
    sensors of a recording without a body go where the provenance says (`segment/<sensor>`), or on
    the segment they are named after; their mounting is nominal then, and the provenance says so.

    Args:
        recording: any.
        body: of `human`, or one that has the sites.

    Raises:
        InputError: nothing says where a sensor is worn, or the recording's own body is of another
            kind than the new one.
    """
    missing = [site for site in _sites(recording) if site not in body.topology.site_names]
    if not missing:
        return dataclasses.replace(recording, body_xml=body.xml)
    if recording.body_xml is None:
        return mounted(recording, body, [_declared(recording, name) for name in missing])
    own = load_body(recording.body_xml)
    if not _same_frames(own, body):
        raise InputError(
            "the recording's sensors are mounted on a body of another kind, whose segments have "
            "other frames; valid: bodies of that kind, or one with a site for each sensor "
            f"({', '.join(missing[:3])}{', ...' if len(missing) > 3 else ''})"
        )
    return dataclasses.replace(recording, body_xml=_with_sites(own, body, missing).xml)


def _sites(recording: Recording) -> tuple[str, ...]:
    """Sites that the measurements need."""
    site_of = {s.name: s.site for s in recording.setup.sensors}
    carriers = [*recording.inertial, *recording.magnetic]
    if (ranges := recording.ranges) is not None:
        carriers += [*ranges.source_names, *ranges.receiver_names]
    return tuple(dict.fromkeys(site_of.get(name, name) for name in carriers))


def _declared(recording: Recording, name: str) -> Worn:
    segment = recording.setup.provenance.get(f"segment/{name}", "")
    return Worn(name, str(segment) or (name if name in XSENS_SEGMENTS else ""), name)


def _same_frames(own: Body, body: Body) -> bool:
    """Whether the bodies differ in lengths only."""
    mine, other = own.topology, body.topology
    if (mine.body_names, mine.joint_names, mine.joint_types) != (
        other.body_names, other.joint_names, other.joint_types,
    ):  # fmt: skip
        return False
    pairs = ((own.body_quat, body.body_quat), (own.joint_axis, body.joint_axis))
    return all(np.abs(np.asarray(a) - np.asarray(b)).max(initial=0.0) < _SAME for a, b in pairs)


def _with_sites(own: Body, body: Body, names: list[str]) -> Body:
    """The body with these sites of the other one, at the same shares of their segments."""
    from mocap_jax.simulation import Mounting, Suit, mount
    from mocap_jax.simulation.suit import SOURCE_PREFIX

    topology = own.topology
    lengths, longer = segment_lengths(own), segment_lengths(body)
    boards: list[Mounting] = []
    sources: list[Mounting] = []
    for name in names:
        i = own.site_index(name)
        segment = topology.body_names[topology.site_body[i]]
        share = longer[segment] / lengths[segment] if segment in lengths else 1.0
        device = Mounting(
            name.removeprefix(SOURCE_PREFIX), segment,
            tuple(share * float(x) for x in own.site_pos[i]),  # type: ignore[arg-type]
            tuple(float(x) for x in own.site_quat[i]),  # type: ignore[arg-type]
        )  # fmt: skip
        (sources if name.startswith(SOURCE_PREFIX) else boards).append(device)
    return mount(body, Suit(tuple(boards), tuple(sources)))

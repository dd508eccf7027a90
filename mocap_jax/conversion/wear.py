"""`wear`: a recording's sensors on another body."""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.body import Body, load_body
from mocap_jax.body.site_names import ANCHOR_PREFIX, SOURCE_PREFIX
from mocap_jax.conversion.mounted import mounted
from mocap_jax.errors import InputError
from mocap_jax.initialise import worn_in_rest_pose
from mocap_jax.initialise.true_mounting import with_true_mounting
from mocap_jax.io.convert import Worn
from mocap_jax.motion import XSENS_SEGMENTS, segment_lengths
from mocap_jax.recording import Recording

# Segment frames of two bodies are taken for the same within this.
_SAME = 1e-6


def wear(recording: Recording, body: Body) -> tuple[Recording, Body]:
    """Put a recording's sensors and sources on another body, which it then holds.

    How follows from what is known of both:

    - a body that has a site for each of them keeps its sites;
    - a recording without a body has its sensors where the provenance says (`segment/<sensor>`), or
      on the segment they are named after; their mounting is nominal, and the provenance says so;
    - between bodies of `human`, whose segment frames agree, they stay on their segments, nearer to
      or farther from the joints as these are shorter or longer;
    - on any other body, such as one of `load_skeleton`, they keep their orientation in the world
      in the declared rest pose (`initialise.worn_in_rest_pose`).

    Anchors stay where they stand in the world. The truth of a simulated recording is told
    from the new body as far as it can be.

    Args:
        recording: any.
        body: with a free root.

    Returns:
        The recording, and the body with a site for every sensor and source.

    Raises:
        InputError: nothing says where a sensor is worn, or the bodies do not correspond.
    """
    missing = [site for site in _sites(recording) if site not in body.topology.site_names]
    if not missing:
        worn, carrier = recording, body
    elif recording.body_xml is None:
        worn = mounted(recording, body, [_declared(recording, name) for name in missing])
        carrier = load_body(worn.body_xml or "")
    else:
        worn, carrier = _moved(recording, load_body(recording.body_xml), body, missing)
    truth = with_true_mounting(recording.truth, carrier)
    return dataclasses.replace(worn, body_xml=carrier.xml, truth=truth), carrier


def _moved(
    recording: Recording, own: Body, body: Body, missing: list[str]
) -> tuple[Recording, Body]:
    """From the recording's own body to the other one."""
    lost = [name for name in missing if name not in own.topology.site_names]
    if lost:
        raise InputError(
            f"neither body has a site for {', '.join(lost)}; sites of the recording's own: "
            f"{', '.join(own.topology.site_names)}"
        )
    _check_standing(own, missing)
    lengths = _lengths(own), _lengths(body)
    if lengths[0] is None or lengths[1] is None or not _same_frames(own, body):
        try:
            return worn_in_rest_pose(recording, body)
        except InputError as error:
            raise InputError(
                "the recording's sensors are mounted on a body of another kind, whose rest pose "
                f"this one cannot take ({error}); valid: bodies with its segments, or with a site "
                f"for each sensor ({', '.join(missing[:3])}{', ...' if len(missing) > 3 else ''})"
            ) from error
    return recording, _with_sites(own, body, missing, (lengths[0], lengths[1]))


def _check_standing(own: Body, names: list[str]) -> None:
    """What is fixed in the world is to be an anchor."""
    for name in names:
        if own.topology.site_body[own.site_index(name)] == 0 and not name.startswith(ANCHOR_PREFIX):
            raise InputError(
                f"site '{name}' of the recording's body is on no segment but in the world; valid: "
                f"sites on segments, and anchors ('{ANCHOR_PREFIX}...')"
            )


def _lengths(body: Body) -> dict[str, float] | None:
    """Of the segments of a body of `human`; None of another one."""
    try:
        return segment_lengths(body)
    except InputError:
        return None


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


def _with_sites(
    own: Body, body: Body, names: list[str], lengths: tuple[dict[str, float], dict[str, float]]
) -> Body:
    """The body with these sites of the other one, at the same shares of their segments."""
    from mocap_jax.simulation import Mounting, Suit, mount
    from mocap_jax.simulation.mounting import standing_anchors

    topology, (usual, longer) = own.topology, lengths
    boards: list[Mounting] = []
    sources: list[Mounting] = []
    anchors = standing_anchors(own, names)
    standing = {anchor.site for anchor in anchors}
    for name in names:
        if name in standing:
            continue
        i = own.site_index(name)
        segment = topology.body_names[topology.site_body[i]]
        share = longer[segment] / usual[segment] if segment in usual else 1.0
        device = Mounting(
            name.removeprefix(SOURCE_PREFIX), segment,
            tuple(share * float(x) for x in own.site_pos[i]),  # type: ignore[arg-type]
            tuple(float(x) for x in own.site_quat[i]),  # type: ignore[arg-type]
        )  # fmt: skip
        (sources if name.startswith(SOURCE_PREFIX) else boards).append(device)
    return mount(body, Suit(tuple(boards), tuple(sources), anchors=anchors))

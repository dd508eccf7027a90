"""A converted recording on a body: sites where the mapping says the sensors are worn."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

from mocap_jax.body import Body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.io.convert import Worn
from mocap_jax.motion import XSENS_SEGMENTS, xsens_name
from mocap_jax.recording import Recording

_IDENTITY = (1.0, 0.0, 0.0, 0.0)


def mounted(recording: Recording, body: Body, worn: Iterable[Worn]) -> Recording:
    """The recording with the body and a site for every sensor.

    A sensor whose position the mapping does not say sits where the standard suit has a board on
    that segment, or at the segment's origin; one whose orientation it does not say is aligned with
    its segment. Both are nominal then, to be calibrated; the provenance says so. A body that
    already has a site of the sensor's name keeps it.

    Raises:
        InputError: a sensor whose segment is unknown or which the body does not have.
    """
    # Imported here: the simulation is slow to load, and most conversions have no body.
    from mocap_jax.simulation import Mounting, Suit, mount

    entries = [w for w in worn if w.name not in body.topology.site_names]
    segments = body.topology.body_names[1:]
    for entry in entries:
        _check_segment(entry, segments)
    usual = _usual_places(body) if any(w.position is None for w in entries) else {}
    boards = tuple(
        Mounting(
            w.name, w.segment, w.position or usual.get(w.segment, (0.0, 0.0, 0.0)),
            w.orientation or _IDENTITY,
        )
        for w in entries
    )  # fmt: skip
    facts = dict(recording.setup.provenance)
    nominal = [w.name for w in entries if w.position is None or w.orientation is None]
    if nominal:
        facts["mounting"] = f"nominal, not calibrated: {', '.join(nominal)}"
    setup = dataclasses.replace(recording.setup, provenance=facts)
    carrier = mount(body, Suit(boards)) if boards else body
    return dataclasses.replace(recording, setup=setup, body_xml=carrier.xml)


def _check_segment(entry: Worn, segments: tuple[str, ...]) -> None:
    where = f"sensor {entry.identity}"
    if not entry.segment:
        raise InputError(
            f"{where}: nothing says on which segment it is worn; give a mapping (--mapping) with "
            f"one of {', '.join(segments[:24])}"
        )
    if entry.segment not in segments and entry.segment not in map(xsens_name, segments):
        raise InputError(f"{where}: {unknown_name('segment', entry.segment, segments)}")


def _usual_places(body: Body) -> dict[str, tuple[float, float, float]]:
    """Places of the standard suit's boards by segment; empty where it does not fit the body."""
    from mocap_jax.simulation import default_suit

    try:
        suit = default_suit(body)
    except InputError:
        return {}
    places: dict[str, tuple[float, float, float]] = {}
    for board in suit.boards:
        places.setdefault(board.segment, board.position)
        if (name := xsens_name(board.segment)) in XSENS_SEGMENTS:
            places.setdefault(name, board.position)
    return places

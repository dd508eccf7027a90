"""Which sensor is on which segment, and which sensor is above which."""

from __future__ import annotations

from collections.abc import Mapping

from mocap_jax.body import Body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.recording import Recording


def worn_segments(
    recording: Recording, body: Body, given: Mapping[str, str] | None = None
) -> dict[str, str]:
    """Segment of each sensor: as given, or as the recording and the body say.

    Without `given`, a sensor is on the segment that its site is on, that the recording names
    (`provenance`, from a mapping), or whose name it bears; other systems' names are understood.

    Raises:
        InputError: an unknown sensor or segment, or a sensor of which nothing says where it is.
    """
    names = body.topology.body_names[1:]
    if given is not None:
        for sensor, segment in given.items():
            if sensor not in recording.inertial:
                raise unknown_name("segments: sensor", sensor, tuple(recording.inertial))
            if segment not in names:
                raise unknown_name(f"segment of sensor '{sensor}':", segment, names)
        return dict(given)
    return {sensor: _segment(sensor, recording, body) for sensor in recording.inertial}


def _segment(sensor: str, recording: Recording, body: Body) -> str:
    from mocap_jax.io.convert.segments import segment_of  # every reader of files comes with it

    topology = body.topology
    if sensor in topology.site_names:
        b = topology.site_body[topology.site_index(sensor)]
        if b > 0:
            return topology.body_names[b]
    stated = recording.setup.provenance.get(f"segment/{sensor}", "")
    names = topology.body_names[1:]
    for name in (str(stated), sensor, sensor.removesuffix("_imu")):
        if name in names:
            return name
        same = [n for n in names if name and segment_of(n) == segment_of(name)]
        if len(same) == 1:
            return same[0]
    raise InputError(
        f"sensor '{sensor}': nothing says on which segment it is worn; give segments, "
        f"valid: {', '.join(names[:24])}"
    )


def sensors_above(segments: Mapping[str, str], body: Body) -> dict[str, str | None]:
    """The sensor on the nearest segment towards the root; None for the topmost.

    Topmost sensors but the first hang on the first: their segments have a common ancestor without
    a sensor. Sensors come after those above them.
    """
    topology = body.topology
    of = {topology.body_index(segment): sensor for sensor, segment in segments.items()}
    order = sorted(segments, key=lambda s: topology.depth[topology.body_index(segments[s])])
    out: dict[str, str | None] = {}
    for sensor in order:
        b = topology.body_index(segments[sensor])
        if of[b] != sensor:  # two sensors on one segment
            out[sensor] = of[b] if of[b] in out else None
            continue
        b = topology.body_parent[b]
        while b != 0 and b not in of:
            b = topology.body_parent[b]
        out[sensor] = of[b] if b != 0 else next(iter(out), None)
    return out

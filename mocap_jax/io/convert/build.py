"""A `Source` as a `Recording`: our units, frames, names and clock; where it came from is kept."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.io.convert.convention import (
    GYROSCOPE_UNITS,
    MAGNETOMETER_UNITS,
    WORLD_UPS,
    Convention,
    Overrides,
    to_orientation,
    to_specific_force,
)
from mocap_jax.io.convert.mapping import Mapping, Worn
from mocap_jax.io.convert.segments import segment_of
from mocap_jax.io.convert.source import RootSamples, SensorSamples, Source
from mocap_jax.recording import (
    InertialStream,
    MagneticStream,
    NoiseFigures,
    Recording,
    RootStream,
    SensorSpec,
    Setup,
    Truth,
)
from mocap_jax.trajectory import Trajectory

_ONE_SEGMENT = (
    '<mujoco><worldbody><body name={name}><freejoint name="root"/><inertial pos="0 0 0" '
    'mass="0.1" diaginertia="1e-5 1e-5 1e-5"/><site name={name}/></body></worldbody></mujoco>'
)
"""Body of a sensor that nobody wears."""


def worn_sensors(source: Source, mapping: Mapping | None) -> dict[str, Worn]:
    """Identity -> where it is worn, of the sensors that go into the recording.

    Without a mapping all do, under the names of the file.

    Raises:
        InputError: the mapping names a sensor that does not exist, or two sensors get one name.
    """
    identities = [s.identity for s in source.sensors]
    if mapping is not None:
        return mapping.of(identities, source.name)
    worn = {}
    for sensor in source.sensors:
        segment = segment_of(sensor.segment or sensor.identity)
        name = sensor.segment or sensor.identity
        worn[sensor.identity] = Worn(sensor.identity, segment, _topic(name))
    names = [w.name for w in worn.values()]
    if twice := next((n for n in names if names.count(n) > 1), None):
        same = [i for i, w in worn.items() if w.name == twice]
        raise InputError(
            f"{source.name}: sensors {', '.join(same)} would all be called '{twice}'; give a "
            "mapping with a name for each"
        )
    return worn


def left_out(source: Source, worn: dict[str, Worn]) -> tuple[str, ...]:
    """What to say of sensors that the mapping does not name."""
    missing = [s.identity for s in source.sensors if s.identity not in worn]
    if not missing:
        return ()
    return (f"Sensors that the mapping does not name are left out: {', '.join(missing)}.",)


@np.errstate(over="ignore", invalid="ignore")  # absurd numbers are told by the checks
def recording_of(
    source: Source,
    worn: dict[str, Worn],
    overrides: Overrides = Overrides(),  # noqa: B008
) -> Recording:
    """The recording, without a body.

    Args:
        source: what a reader returned.
        worn: which sensors go into it, and their names (see `worn_sensors`).
        overrides: what the user knows better about units and frames.

    Raises:
        InputError: no samples, quaternions that are none, gravity that cannot be brought back.
    """
    convention = source.convention.with_overrides(overrides, source.name)
    chosen = [s for s in source.sensors if s.identity in worn]
    if not chosen:
        raise InputError(f"{source.name}: no sensors to convert")
    start = _start(chosen, source)
    inertial, magnetic = {}, {}
    for sensor in chosen:
        name = worn[sensor.identity].name
        inertial[name] = _inertial(sensor, convention, start, f"{source.name}: {sensor.identity}")
        if sensor.magnetic is not None:
            magnetic[name] = _magnetic(sensor, convention, start)
    facts: dict[str, str | float | int | bool] = {
        "source_format": source.format, "source": Path(source.name).name, **source.facts,
        **convention.facts(), **_worn_facts(worn),
    }  # fmt: skip
    return Recording(
        inertial=inertial,
        ranges=None,
        root=_measured_root(source, convention, start),
        magnetic=magnetic,
        temperature=None,
        truth=_truth(source, convention, start, [w.name for w in worn.values()]),
        setup=Setup(
            sensors=tuple(
                SensorSpec(worn[s.identity].name, worn[s.identity].name, s.rate_hz) for s in chosen
            ),
            noise=NoiseFigures(),
            provenance=facts,
        ),
        body_xml=None,
        start_utc_ns=0 if source.start_utc_ns is None
        else source.start_utc_ns + round(start * 1e9),
        subject=source.subject,
        salvage=source.salvage,
    )  # fmt: skip


def _start(sensors: Sequence[SensorSamples], source: Source) -> float:
    """Time of the first sample of all: becomes zero."""
    times = [s.time[0] for s in sensors if len(s.time)]
    if not times:
        raise InputError(f"{source.name}: holds no samples")
    return float(min(times))


def _inertial(
    sensor: SensorSamples, convention: Convention, start: float, where: str
) -> InertialStream:
    n = len(sensor.time)
    orientation, force, rate = (np.full((n, width), np.nan) for width in (4, 3, 3))
    if sensor.orientation is not None:
        orientation = to_orientation(sensor.orientation, convention, where)
    if sensor.accelerometer is not None:
        force = to_specific_force(sensor.accelerometer, orientation, convention, where)
    if sensor.gyroscope is not None:
        rate = np.asarray(sensor.gyroscope, float) * GYROSCOPE_UNITS[convention.gyroscope_unit]
    return InertialStream(np.asarray(sensor.time, float) - start, force, rate, orientation)


def _magnetic(sensor: SensorSamples, convention: Convention, start: float) -> MagneticStream:
    assert sensor.magnetic is not None
    time = sensor.time if sensor.magnetic_time is None else sensor.magnetic_time
    scale = MAGNETOMETER_UNITS[convention.magnetometer_unit]
    return MagneticStream(
        np.asarray(time, float) - start, np.asarray(sensor.magnetic, float) * scale
    )


def _measured_root(source: Source, convention: Convention, start: float) -> RootStream | None:
    """The measured root pose; None where there is none, or where it is the truth."""
    if source.root is None or source.root.truth:
        return None
    return RootStream(*_root(source.root, convention, start, source.name))


def _truth(
    source: Source, convention: Convention, start: float, names: list[str]
) -> Truth | None:  # fmt: skip
    """The reference of the only sensor, as the motion of a body of one segment."""
    if source.root is None or not source.root.truth:
        return None
    time, position, orientation = _root(source.root, convention, start, source.name)
    q = np.concatenate([position, orientation], axis=1)
    return Truth(Trajectory(time, q), _ONE_SEGMENT.format(name=quoteattr(names[0])))


def _root(
    root: RootSamples, convention: Convention, start: float, where: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, positions and orientations, missing samples left out."""
    orientation = to_orientation(root.orientation, convention, f"{where}: root")
    position = np.asarray(root.position, float) @ WORLD_UPS[convention.world_up].T
    good = np.isfinite(orientation).all(axis=1) & np.isfinite(position).all(axis=1)
    return root.time[good] - start, position[good], orientation[good]


def _worn_facts(worn: dict[str, Worn]) -> dict[str, str | float | int | bool]:
    facts: dict[str, str | float | int | bool] = {}
    for identity, entry in worn.items():
        facts[f"sensor/{entry.name}"] = identity
        if entry.segment:
            facts[f"segment/{entry.name}"] = entry.segment
    return facts


def _topic(name: str) -> str:
    """A name that topics and sites can carry."""
    return name.strip().replace(" ", "_").replace("/", "_")

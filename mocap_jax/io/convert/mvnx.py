"""MVNX, the XML export of Xsens MVN (versions 3 and 4), read as a stream.

`sensorFreeAcceleration` has gravity removed and stands in the world frame; the sensor's orientation
turns it back into specific force. Older files hold `sensorAcceleration` (in the sensor frame,
gravity included) and `sensorAngularVelocity`; newer ones have no gyroscope readings, so that the
angular velocity of MVN's segment, turned into the sensor's frame, stands in (the provenance says
so). Segment poses are MVN's own reconstruction.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation
from tqdm import tqdm

from mocap_jax.errors import InputError
from mocap_jax.io.convert.clock import increasing
from mocap_jax.io.convert.convention import Convention
from mocap_jax.io.convert.paths import files_of, one_file
from mocap_jax.io.convert.source import ReadOptions, SegmentPoses, SensorSamples, Source

NAME = "mvnx"
SUMMARY = "XML export of Xsens MVN"
CONVENTION = Convention(
    magnetometer_unit="a.u.", acceleration="free-world",
    heading="MVN's: x axis to magnetic north, or as reset in MVN",
)  # fmt: skip
_SENSOR_FIELDS = {
    "sensorOrientation": 4, "sensorFreeAcceleration": 3, "sensorAcceleration": 3,
    "sensorAngularVelocity": 3, "sensorMagneticField": 3,
}  # fmt: skip
_SEGMENT_FIELDS = {"orientation": 4, "position": 3, "angularVelocity": 3}
# Poses of the character in which all segments are aligned with the world.
_ALIGNED = ("identity", "tpose")


@dataclass
class _Content:
    """What has been read so far."""

    subject: dict[str, str] = field(default_factory=dict)
    version: str = ""
    segments: list[str] = field(default_factory=list)
    sensors: list[str] = field(default_factory=list)
    time_ms: list[float] = field(default_factory=list)
    values: dict[str, list[np.ndarray]] = field(default_factory=dict)
    aligned: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    """Kind of calibration frame -> its fields."""
    salvage: tuple[str, ...] = ()


def recognises(paths: list[Path]) -> bool:
    """Whether this is an MVNX file."""
    return bool(files_of(paths, (".mvnx",)))


def read(paths: list[Path], options: ReadOptions) -> Source:
    """Read one file; one that breaks off is read up to its last whole frame.

    Raises:
        InputError: not MVNX, no sensor data, frames of the wrong length.
    """
    file = one_file(paths, (".mvnx",), "MVNX file")
    content = _Content()
    try:
        for frame in _frames(file, content, options.progress):
            _add(content, frame, file)
    except ElementTree.ParseError as error:
        if not content.time_ms:
            raise InputError(f"{file}: not valid MVNX: {error}") from error
        content.salvage = (f"{file.name}: breaks off after {len(content.time_ms)} frames.",)
    if not content.time_ms:
        raise InputError(f"{file}: holds no frames of type 'normal' (is it MVNX?)")
    return _source(file, content, options)


def _tag(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _frames(file: Path, content: _Content, progress: bool) -> Iterator[ElementTree.Element]:
    """The frames; what stands before them goes into `content`."""
    with (
        open(file, "rb") as stream,
        tqdm(total=file.stat().st_size, desc="reading", unit="B", unit_scale=True,
             disable=not progress, leave=False) as bar,
    ):  # fmt: skip
        root = None
        for event, element in ElementTree.iterparse(stream, events=("start", "end")):
            tag = _tag(element)
            if root is None:
                root = element
                if tag != "mvnx":
                    raise InputError(f"{file}: not MVNX: the document is <{tag}>")
                content.version = element.get("version", "")
            if event == "start":
                if tag == "subject":
                    content.subject = dict(element.attrib)
                continue
            if tag == "segment" and element.get("label"):
                content.segments.append(element.get("label", ""))
            elif tag == "sensor" and element.get("label"):
                content.sensors.append(element.get("label", ""))
            elif tag == "frame":
                bar.update(stream.tell() - bar.n)
                yield element
                element.clear()


def _add(content: _Content, frame: ElementTree.Element, file: Path) -> None:
    kind = frame.get("type", "normal")
    index = frame.get("index") or str(len(content.time_ms))
    where = f"{file}: frame {index}"
    sizes = {k: w * len(content.sensors) for k, w in _SENSOR_FIELDS.items()}
    sizes |= {k: w * len(content.segments) for k, w in _SEGMENT_FIELDS.items()}
    fields = {}
    for element in frame:
        tag = _tag(element)
        if tag in sizes:
            fields[tag] = _numbers(element.text or "", sizes[tag], f"{where}: {tag}")
    if kind != "normal":
        content.aligned[kind] = fields
        return
    if content.values and set(fields) != set(content.values):
        missing = sorted(set(content.values) ^ set(fields))
        raise InputError(f"{where}: lacks or adds {', '.join(missing)}")
    try:
        content.time_ms.append(float(frame.get("time", "nan")))
    except ValueError:
        raise InputError(f"{where}: time '{frame.get('time')}' is not a number") from None
    for tag, values in fields.items():
        content.values.setdefault(tag, []).append(values)


def _numbers(text: str, count: int, where: str) -> np.ndarray:
    try:
        values = np.array(text.split(), float)
    except ValueError as error:
        raise InputError(f"{where}: {error}") from error
    if len(values) != count:
        raise InputError(f"{where}: has {len(values)} numbers, expected {count}")
    return values


def _source(file: Path, content: _Content, options: ReadOptions) -> Source:
    if not content.sensors or "sensorOrientation" not in content.values:
        found = ", ".join(content.values) or "nothing"
        raise InputError(
            f"{file}: no sensor data (export with sensorOrientation and sensorFreeAcceleration); "
            f"frames hold {found}"
        )
    fields = {
        tag: np.reshape(rows, (len(rows), -1, _SENSOR_FIELDS.get(tag) or _SEGMENT_FIELDS[tag]))
        for tag, rows in content.values.items()
    }
    time, rate = _time(file, content, options)
    rates, origin = _rates(fields, content)
    free = "sensorFreeAcceleration" in fields
    force = fields.get("sensorFreeAcceleration" if free else "sensorAcceleration")
    one = lambda values, i: None if values is None else values[:, i]  # noqa: E731
    sensors = tuple(
        SensorSamples(
            label, time, rate, one(force, i), one(rates, i), fields["sensorOrientation"][:, i],
            magnetic=one(fields.get("sensorMagneticField"), i), segment=label,
        )
        for i, label in enumerate(content.sensors)
    )  # fmt: skip
    acceleration = "free-world" if free else "specific-force"
    return Source(
        NAME, str(file), sensors,
        Convention(**{**CONVENTION.__dict__, "acceleration": acceleration}),
        {"device": "Xsens MVN", "sampling_rate_hz": rate, "clock": "frame times of MVN",
         "mvnx_version": content.version, "gyroscope": origin},
        content.salvage, poses=_poses(fields, content, time),
        start_utc_ns=_start(content), subject=content.subject.get("label", ""),
    )  # fmt: skip


def _time(file: Path, content: _Content, options: ReadOptions) -> tuple[np.ndarray, float]:
    """Frame times [s]: whole milliseconds in the file, so the even grid is used where they fit."""
    rate = options.rate_hz or float(content.subject.get("frameRate", "nan"))
    stamped = increasing(np.array(content.time_ms) / 1000.0, str(file))
    if not rate > 0:
        rate = float(1.0 / np.median(np.diff(stamped))) if len(stamped) > 1 else 1.0
    even = stamped[0] + np.rint((stamped - stamped[0]) * rate) / rate
    fits = np.abs(even - stamped).max() < 1.1e-3 and (np.diff(even) > 0).all()
    return (even if fits else stamped), rate


def _rates(fields: dict[str, np.ndarray], content: _Content) -> tuple[np.ndarray | None, str]:
    """Angular velocities in the sensor frames, and where they come from."""
    if "sensorAngularVelocity" in fields:
        return fields["sensorAngularVelocity"], "sensors"
    if "angularVelocity" not in fields:
        return None, "none"
    R_world_sensor = fields["sensorOrientation"]
    out = np.full((*R_world_sensor.shape[:2], 3), np.nan)
    for i, label in enumerate(content.sensors):
        if label in content.segments:
            rotation = Rotation.from_quat(R_world_sensor[:, i], scalar_first=True)
            in_world = fields["angularVelocity"][:, content.segments.index(label)]
            out[:, i] = rotation.inv().apply(in_world)
    return out, "angular velocity of MVN's segments, turned into the sensor frames"


def _poses(
    fields: dict[str, np.ndarray], content: _Content, time: np.ndarray
) -> SegmentPoses | None:
    if "orientation" not in fields or "position" not in fields:
        return None
    kind = next((k for k in _ALIGNED if "position" in content.aligned.get(k, {})), None)
    offsets = None if kind is None else content.aligned[kind]["position"].reshape(-1, 3)
    if kind == "tpose" and offsets is not None and "orientation" in content.aligned[kind]:
        turn = content.aligned[kind]["orientation"].reshape(-1, 4)
        # Only a T-pose that faces along x has all segments aligned with the world.
        offsets = offsets if np.abs(turn[:, 0]).min() > np.cos(np.deg2rad(0.5)) else None
    return SegmentPoses(
        tuple(content.segments), time, fields["orientation"], fields["position"], offsets
    )


def _start(content: _Content) -> int | None:
    try:
        return int(content.subject["recDateMSecsSinceEpoch"]) * 10**6
    except (KeyError, ValueError):
        return None

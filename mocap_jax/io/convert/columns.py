"""Mappings of columns or variables (TOML): what a plain CSV or MATLAB file holds, and where.

format = "csv"                           # or "mat"
header = false                           # CSV only: no line names the columns; 1, 2, ... do then
time = "t"                               # column or variable; or rate_hz instead
time_unit = "s"                          # s, ms, us or ns
rate_hz = 100.0                          # number, or name of a variable
accelerometer_unit = "g"                 # m/s^2 (default), g, mg
gyroscope_unit = "deg/s"                 # rad/s (default), deg/s, mdeg/s, rev/s
magnetometer_unit = "uT"                 # T, mT, uT (default), nT, G, mG, a.u.
quaternion_order = "xyzw"                # wxyz (default) or xyzw
quaternion_direction = "sensor-to-world" # or world-to-sensor
gravity_sign = 1                         # -1: reads -g along up at rest
acceleration = "specific-force"          # free-world, free-sensor: gravity was removed
world_up = "z"                           # y, x or -z
heading = "magnetic north"               # in words
remark = "Second visit."                 # said after every conversion

[[sensors]]
segment = "T8"
name = "chest"                           # default: the segment's name
file = "chest.csv"                       # CSV only, where each sensor has a file
time = "t_chest"                         # where sensors have their own
accelerometer = ["ax", "ay", "az"]       # three columns, or one variable (n, 3)
gyroscope = "chest.gyr"                  # `.` goes into structures, `[3:6]` takes columns
magnetometer = ["mx", "my", "mz"]
orientation = ["qw", "qx", "qy", "qz"]   # four columns, or nine of a matrix, row by row
mount_position = [0.1, 0.0, 0.2]         # in the segment's frame [m]
mount_orientation = [1.0, 0.0, 0.0, 0.0] # R_segment_sensor (wxyz)

[root]                                   # an externally measured pose of the root segment
position = "opt_pos"
orientation = "opt_quat"
truth = true                             # a reference of the only sensor, no measurement
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.io.convert.convention import Convention
from mocap_jax.io.convert.mapping import Mapping, Worn, mount_of, parse_toml
from mocap_jax.io.convert.segments import segment_of

PRESETS = Path(__file__).with_name("presets")
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_CONVENTION = tuple(f.name for f in dataclasses.fields(Convention))
_TOP = ("format", "summary", "time", "time_unit", "rate_hz", "device", "sensors", "root",
        "delimiter", "header", "remark", *_CONVENTION)  # fmt: skip
_KINDS = ("accelerometer", "gyroscope", "magnetometer", "orientation")
_SENSOR = ("name", "segment", "file", "time", *_KINDS, "mount_position", "mount_orientation")
_FORMATS = ("csv", "mat")


@dataclass(frozen=True)
class SensorColumns:
    """Where one sensor's samples stand."""

    worn: Worn
    columns: dict[str, list[str]]
    """Kind of measurement -> columns or variables."""
    file: str | None = None
    time: str | None = None


@dataclass(frozen=True)
class ColumnMapping:
    """What a plain file holds."""

    name: str
    format: str
    convention: Convention
    sensors: tuple[SensorColumns, ...]
    time: str | None = None
    time_unit: str = "s"
    rate_hz: float | str | None = None
    device: str = ""
    delimiter: str | None = None
    header: bool = True
    """Whether a line names the columns; they are numbered from 1 otherwise."""
    remark: str = ""
    """Said after every conversion with this mapping."""
    root: dict[str, list[str]] = field(default_factory=dict)
    root_is_truth: bool = False
    """The root's pose is a reference, not a measurement."""

    @property
    def mapping(self) -> Mapping:
        """Which sensors are worn where, by their own names."""
        return Mapping(self.name, tuple(s.worn for s in self.sensors))


def presets() -> dict[str, Path]:
    """Mappings that come with the package, by name."""
    return {p.stem: p for p in sorted(PRESETS.glob("*.toml"))}


def is_column_mapping(path: Path) -> bool:
    """Whether a TOML file maps columns (rather than serial numbers to segments)."""
    return path.suffix.lower() == ".toml" and path.is_file() and "format" in parse_toml(path)


def read_column_mapping(mapping: str | None, wanted: str, where: str) -> ColumnMapping:
    """Read a mapping by file or by a preset's name.

    Args:
        mapping: file or name; None is an error that says what to write.
        wanted: the format that the reader is for.
        where: the source, for messages.

    Raises:
        InputError: missing file, unknown preset, key or choice, a sensor without columns.
    """
    if mapping is None:
        raise InputError(
            f"{where}: needs a mapping that says what its columns are (--mapping FILE.toml, see "
            f"docs/converting.md), or a preset: {', '.join(presets())}"
        )
    path = presets().get(mapping, Path(mapping))
    if not path.is_file():
        raise InputError(
            f"{mapping}: no such mapping file or {unknown_name('preset', mapping, presets())}"
        )
    document = parse_toml(path)
    _known(document, _TOP, str(path))
    kind = document.get("format")
    if kind not in _FORMATS:
        raise InputError(f"{path}: {unknown_name('format', str(kind), _FORMATS)}")
    if kind != wanted:
        raise InputError(f"{path}: is a mapping of {kind} files; {where} is read as {wanted}")
    return _mapping(document, str(path))


def _mapping(document: dict[str, Any], name: str) -> ColumnMapping:
    given = {k: document[k] for k in _CONVENTION if k in document}
    entries = document.get("sensors", [])
    if not isinstance(entries, list) or not all(isinstance(e, dict) for e in entries):
        raise InputError(f"{name}: 'sensors' must be written as [[sensors]] entries")
    if not entries:
        raise InputError(f"{name}: names no sensors; write at least one [[sensors]] entry")
    unit = document.get("time_unit", "s")
    if unit not in TIME_UNITS:
        raise InputError(f"{name}: {unknown_name('time unit', str(unit), TIME_UNITS)}")
    rate = document.get("rate_hz")
    if isinstance(rate, bool) or not (rate is None or isinstance(rate, int | float | str)):
        raise InputError(f"{name}: 'rate_hz' must be a number or the name of a variable")
    sensors = tuple(_sensor(e, f"{name}: sensors[{i}]") for i, e in enumerate(entries))
    names = [s.worn.name for s in sensors]
    identities = [s.worn.identity for s in sensors]
    if len(set(identities)) < len(identities):  # several sensors of one file
        sensors = tuple(
            dataclasses.replace(s, worn=dataclasses.replace(s.worn, identity=s.worn.name))
            for s in sensors
        )
    if twice := next((n for n in names if names.count(n) > 1), None):
        raise InputError(f"{name}: sensor '{twice}' is there twice; give each a name of its own")
    root = document.get("root", {})
    _known(root, ("position", "orientation", "truth"), f"{name}: [root]")
    truth, header = root.get("truth", False), document.get("header", True)
    for key, value in (("root.truth", truth), ("header", header)):
        if not isinstance(value, bool):
            raise InputError(f"{name}: {key} must be true or false")
    if "header" in document and document["format"] != "csv":
        raise InputError(f"{name}: 'header' is for csv files; {document['format']} files have none")
    columns = {k: v for k, v in root.items() if k != "truth"}
    if root and len(columns) != 2:
        raise InputError(f"{name}: [root] needs position and orientation")
    if truth and len(sensors) > 1:
        raise InputError(f"{name}: root.truth is for one sensor, whose pose it is")
    return ColumnMapping(
        name, document["format"], Convention(**given).checked(name), sensors,
        _column(document.get("time")), unit, float(rate) if isinstance(rate, int) else rate,
        str(document.get("device", "")), document.get("delimiter"), header,
        str(document.get("remark", "")),
        {k: _columns(v, f"{name}: root.{k}") for k, v in columns.items()}, truth,
    )  # fmt: skip


def _sensor(entry: dict[str, Any], where: str) -> SensorColumns:
    _known(entry, _SENSOR, where)
    if not any(kind in entry for kind in _KINDS):
        raise InputError(f"{where}: no columns; valid: {', '.join(_KINDS)}")
    segment = str(entry.get("segment", ""))
    name = str(entry.get("name") or segment)
    if not name:
        raise InputError(f"{where}: needs a segment or a name")
    mount = {k.removeprefix("mount_"): v for k, v in entry.items() if k.startswith("mount_")}
    position, orientation = mount_of(mount, where)
    columns = {k: _columns(entry[k], f"{where}: {k}") for k in _KINDS if k in entry}
    identity = entry.get("file") or _structure(columns) or name
    worn = Worn(identity, segment_of(segment) if segment else "", name, position, orientation)
    return SensorColumns(worn, columns, entry.get("file"), _column(entry.get("time")))


def _structure(columns: dict[str, list[str]]) -> str:
    """The structure that holds all variables of a sensor, which is what the file calls it."""
    parents = {n.rpartition(".")[0] for names in columns.values() for n in names}
    return parents.pop() if len(parents) == 1 else ""


def _columns(value: Any, where: str) -> list[str]:
    names = [_column(v) for v in (value if isinstance(value, list) else [value])]
    if not all(isinstance(n, str) for n in names) or not names:
        raise InputError(f"{where} must be a name or a list of names")
    return names


def _column(value: Any) -> Any:
    """A column's number as its name; all else as it is."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _known(table: Any, valid: tuple[str, ...], where: str) -> None:
    if not isinstance(table, dict):
        raise InputError(f"{where}: must be a table")
    for key in table:
        if key not in valid:
            raise InputError(f"{where}: {unknown_name('key', key, valid)}")

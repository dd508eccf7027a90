"""Which sensor is worn on which segment: OpenSense XML, our TOML, or CSV.

    [[sensors]]
    id = "00B42268"                          # what the files call it
    segment = "T8"                           # Xsens name, or a body's own
    name = "chest"                           # in the recording; default: the segment's name
    position = [0.1, 0.0, 0.2]               # of the sensor in the segment's frame [m]; optional
    orientation = [1.0, 0.0, 0.0, 0.0]       # R_segment_sensor (wxyz); optional

As CSV: a header `id,segment` or `id,segment,name`, and a line a sensor. The OpenSense file is
`myIMUMappings.xml` (`XsensDataReaderSettings` or `APDMDataReaderSettings`).
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.io.convert.segments import segment_of
from mocap_jax.io.convert.text_table import read_table

_KEYS = ("id", "segment", "name", "position", "orientation")


@dataclass(frozen=True)
class Worn:
    """Where one sensor is worn."""

    identity: str
    """What the files call it."""
    segment: str
    """Xsens name, or a body's own; empty if it is not known."""
    name: str
    """In the recording; also its site's."""
    position: tuple[float, float, float] | None = None
    """In the segment's frame [m]; None: not known."""
    orientation: tuple[float, float, float, float] | None = None
    """R_segment_sensor (wxyz); None: not known."""


@dataclass(frozen=True)
class Mapping:
    """Which sensors are worn, and where."""

    name: str
    """The file, for messages."""
    worn: tuple[Worn, ...]
    trial: str | None = None
    """Common beginning of the trial's files, if the mapping says it."""

    def of(self, identities: list[str], where: str) -> dict[str, Worn]:
        """Mapped sensors among those of a recording.

        Args:
            identities: what the recording calls its sensors.
            where: the recording, for messages.

        Raises:
            InputError: the mapping names a sensor that the recording does not have.
        """
        out = {}
        for entry in self.worn:
            match = [i for i in identities if _same(i, entry.identity)]
            if not match:
                error = unknown_name("sensor", entry.identity, identities)
                raise InputError(f"{self.name}: {where} has no such sensor: {error}")
            out[match[0]] = entry
        return out


def read_mapping(path: Path) -> Mapping:
    """Read a mapping of sensors to segments, by suffix.

    Raises:
        InputError: missing or malformed file, unknown key, a sensor or a name that is there twice.
    """
    readers = {".xml": _from_xml, ".toml": _from_toml, ".csv": _from_csv}
    if not path.is_file():
        raise InputError(f"{path}: no such mapping file")
    if path.suffix.lower() not in readers:
        raise InputError(
            f"{path}: unknown kind of mapping '{path.suffix}'; valid: {', '.join(readers)}"
        )
    mapping = readers[path.suffix.lower()](path)
    if not mapping.worn:
        raise InputError(f"{path}: names no sensors")
    for what, values in (
        ("sensor", [w.identity for w in mapping.worn]),
        ("name", [w.name for w in mapping.worn]),
    ):
        twice = next((v for v in values if values.count(v) > 1), None)
        if twice is not None:
            raise InputError(f"{path}: {what} '{twice}' is there twice")
    return mapping


def _same(identity: str, wanted: str) -> bool:
    """Serial numbers stand alone, after a model name, or in another case."""
    a, b = identity.lower(), wanted.lower().lstrip("_")
    return a == b or a.endswith(("_" + b, " " + b))


def _from_xml(path: Path) -> Mapping:
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid XML: {error}") from error
    entries = root.findall(".//ExperimentalSensor")
    if not entries:
        raise InputError(
            f"{path}: no <ExperimentalSensor> entries; expected an OpenSense file such as "
            "myIMUMappings.xml"
        )
    worn = []
    for i, entry in enumerate(entries):
        identity = (entry.get("name") or "").strip().lstrip("_")
        label = (entry.findtext("name_in_model") or "").strip()
        if not identity or not label:
            raise InputError(
                f"{path}: <ExperimentalSensor> {i + 1} lacks its name or <name_in_model>"
            )
        worn.append(Worn(identity, segment_of(label), label))
    trial = (root.findtext(".//trial_prefix") or "").strip()
    return Mapping(str(path), tuple(worn), trial or None)


def _from_csv(path: Path) -> Mapping:
    table = read_table(path)
    for name in ("id", "segment"):
        if name not in table.names:
            raise InputError(f"{path}: no column '{name}'; needed are id, segment")
    rows = [dict(zip(table.names, row, strict=True)) for row in table.rows]
    worn = tuple(_worn(row, f"{path}: line {table.first_line + i}") for i, row in enumerate(rows))
    return Mapping(str(path), worn)


def _from_toml(path: Path) -> Mapping:
    document = parse_toml(path)
    for key in document:
        if key not in ("sensors", "trial"):
            raise InputError(f"{path}: {unknown_name('entry', key, ('sensors', 'trial'))}")
    entries = document.get("sensors", [])
    if not isinstance(entries, list) or not all(isinstance(e, dict) for e in entries):
        raise InputError(f"{path}: 'sensors' must be written as [[sensors]] entries")
    worn = tuple(_worn(entry, f"{path}: sensors[{i}]") for i, entry in enumerate(entries))
    return Mapping(str(path), worn, document.get("trial"))


def parse_toml(path: Path) -> dict[str, Any]:
    """A TOML document; raises `InputError` where it is none."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid TOML: {error}") from error


def _worn(entry: dict[str, Any], where: str) -> Worn:
    for key in entry:
        if key not in _KEYS:
            raise InputError(f"{where}: {unknown_name('key', key, _KEYS)}")
    for key in ("id", "segment"):
        if not isinstance(entry.get(key), str) or not entry[key]:
            raise InputError(f"{where}: '{key}' is missing or not text; needed are id, segment")
    segment = segment_of(entry["segment"])
    position, orientation = mount_of(entry, where)
    return Worn(entry["id"], segment, str(entry.get("name") or segment), position, orientation)


def mount_of(
    entry: dict[str, Any], where: str
) -> tuple[tuple[float, float, float] | None, tuple[float, float, float, float] | None]:
    """`position` and `orientation` of an entry, None where it has none.

    Raises:
        InputError: not three numbers, or not a unit quaternion.
    """
    position = numbers(entry["position"], 3, f"{where}: position") if "position" in entry else None
    turn = (
        numbers(entry["orientation"], 4, f"{where}: orientation")
        if "orientation" in entry
        else None
    )
    if turn is not None:
        length = math.hypot(*turn)
        if abs(length - 1) > 1e-2:
            raise InputError(
                f"{where}: orientation has length {length:.4g}, expected a unit quaternion (wxyz)"
            )
        turn = tuple(x / length for x in turn)
    return position, turn  # type: ignore[return-value]


def numbers(value: Any, count: int, where: str) -> tuple[float, ...]:
    """A list of so many finite numbers.

    Raises:
        InputError: anything else.
    """
    good = (
        isinstance(value, list)
        and len(value) == count
        and all(isinstance(x, int | float) and not isinstance(x, bool) for x in value)
        and all(math.isfinite(x) for x in value)
    )
    if not good:
        raise InputError(f"{where} must be {count} numbers in a list")
    return tuple(float(x) for x in value)

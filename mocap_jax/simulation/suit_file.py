"""Set-up files: a user's own suit as TOML.

    [[boards]]
    name = "left_wrist"                      # also the sensor's name in the recording
    segment = "LeftForeArm"                  # body of the MJCF, or its Xsens name
    position = [0.02, 0.03, -0.2]            # in the segment's frame [m]
    orientation = [1.0, 0.0, 0.0, 0.0]       # R_segment_board, wxyz; z away from the skin

    [[sources]]                              # ultrasonic; z is the emission axis
    name = "chest"
    segment = "T8"
    position = [0.1, 0.0, 0.05]
    orientation = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0]
    frequency = 40000.0                      # of its bursts [Hz]; those of different ones sound at
                                             # the same time

    [[anchors]]                              # ultrasonic, fixed in the world
    name = "door"
    position = [1.0, 0.0, 2.0]               # in the world [m]
    emits = false                            # a receiver (the default) or a source, which may
                                             # have a frequency too

`layout = "default"` at the top starts from the standard suit of the body instead, or from a suit of
`SUITS` by its name; entries of the file are then added, replacing those of the same name.
`[noise]` and `[calibration]` may stand in the same file (docs/setup_toml.md).
"""

from __future__ import annotations

import dataclasses
import math
import os
import tomllib
from pathlib import Path

import tomli_w

from mocap_jax.body import Body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.motion import xsens_name
from mocap_jax.simulation.default_suit import default_suit
from mocap_jax.simulation.named_suits import SUITS, named_suit
from mocap_jax.simulation.suit import (
    ANCHOR_PREFIX,
    BURST_HZ,
    SOURCE_PREFIX,
    Anchor,
    Mounting,
    Suit,
)

_KEYS = ("name", "segment", "position", "orientation")
_SOURCE_KEYS = (*_KEYS, "frequency")
_ANCHOR_KEYS = ("name", "position", "orientation", "emits", "frequency")
_TABLES = ("boards", "sources", "anchors")
_ENTRIES = (*_TABLES, "layout", "noise", "calibration")
_LAYOUTS = ("default", *SUITS)


def load_suit(path: str | os.PathLike[str], body: Body | None = None) -> Suit:
    """Read a set-up file.

    Args:
        path: TOML file as described at the top of this module.
        body: checks the segments against this body; needed where the file names a layout.

    Raises:
        InputError: missing or malformed file, unknown key, segment or layout, a wrong number of
            values, a name given twice.
    """
    document = _parse(Path(path))
    base = _base(document, body, path)
    devices = {}
    for table in _TABLES:
        entries = document.get(table, [])
        if not isinstance(entries, list) or not all(isinstance(e, dict) for e in entries):
            raise InputError(f"{path}: '{table}' must be written as [[{table}]] entries")
        places = [f"{path}: {table}[{i}]" for i in range(len(entries))]
        read = (
            [_anchor(e, where) for e, where in zip(entries, places, strict=True)]
            if table == "anchors"
            else [
                _mounting(e, where, body, _KEYS if table == "boards" else _SOURCE_KEYS)
                for e, where in zip(entries, places, strict=True)
            ]
        )
        names = [m.name for m in read]
        twice = next((n for n in names if names.count(n) > 1), None)
        if twice is not None:
            raise InputError(f"{path}: {table} '{twice}' is there twice; names must differ")
        kept = tuple(m for m in getattr(base, table) if m.name not in names)
        devices[table] = kept + tuple(read)
    suit = Suit(devices["boards"], devices["sources"], base.omitted, devices["anchors"])
    if not suit.boards and not (suit.sources and suit.listening_anchors):
        raise InputError(
            f"{path}: no boards; write at least one [[boards]] entry, or [[sources]] and "
            "[[anchors]]"
        )
    return suit


def save_suit(path: str | os.PathLike[str], suit: Suit) -> None:
    """Write a suit as a set-up file that `load_suit` reads back to the last digit."""
    document = {
        table: [dataclasses.asdict(device) for device in getattr(suit, table)] for table in _TABLES
    }
    for board in document["boards"]:
        del board["frequency"]
    Path(path).write_text(tomli_w.dumps(document), encoding="utf-8")


def _parse(path: Path) -> dict[str, object]:
    if not path.is_file():
        raise InputError(f"{path}: no such set-up file")
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid TOML: {error}") from error
    for key in document:
        if key not in _ENTRIES:
            raise InputError(f"{path}: {unknown_name('entry', key, _ENTRIES)}")
    return document


def _base(document: dict[str, object], body: Body | None, path: object) -> Suit:
    layout = document.get("layout")
    if layout is None:
        return Suit(())
    if layout not in _LAYOUTS:
        raise InputError(f"{path}: {unknown_name('layout', str(layout), _LAYOUTS)}")
    if body is None:
        raise InputError(f"{path}: layout '{layout}' is fitted to a body; give the body as well")
    return default_suit(body) if layout == "default" else named_suit(str(layout), body)


def _anchor(entry: dict[str, object], where: str) -> Anchor:
    _check_keys(entry, where, _ANCHOR_KEYS, ("name", "position"))
    name, emits = entry["name"], entry.get("emits", False)
    if not isinstance(name, str) or not name:
        raise InputError(f"{where}: name must be text")
    if not isinstance(emits, bool):
        raise InputError(f"{where} '{name}': emits must be true or false")
    position, turn = _pose(entry, where, name)
    return Anchor(name.removeprefix(ANCHOR_PREFIX), position, turn, emits, _frequency(entry, where))


def _frequency(entry: dict[str, object], where: str) -> float:
    value = entry.get("frequency", BURST_HZ)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value < math.inf:
        raise InputError(f"{where}: frequency must be a number above 0 [Hz]")
    return float(value)


def _check_keys(
    entry: dict[str, object], where: str, valid: tuple[str, ...], needed: tuple[str, ...]
) -> None:
    for key in entry:
        if key not in valid:
            raise InputError(f"{where}: {unknown_name('key', key, valid)}")
    for key in needed:
        if key not in entry:
            raise InputError(f"{where}: '{key}' is missing; needed are {', '.join(needed)}")


def _mounting(
    entry: dict[str, object], where: str, body: Body | None, keys: tuple[str, ...]
) -> Mounting:
    _check_keys(entry, where, keys, ("name", "segment", "position"))
    name, segment = entry["name"], entry["segment"]
    if not isinstance(name, str) or not name or not isinstance(segment, str):
        raise InputError(f"{where}: name and segment must be text")
    if body is not None:
        own = body.topology.body_names[1:]
        if segment not in own and segment not in {xsens_name(n) for n in own}:
            raise InputError(f"{where} '{name}': {unknown_name('segment', segment, own)}")
    position, turn = _pose(entry, where, name)
    frequency = _frequency(entry, where)
    return Mounting(name.removeprefix(SOURCE_PREFIX), segment, position, turn, frequency)


def _pose(
    entry: dict[str, object], where: str, name: str
) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
    """Position, and orientation of unit length."""
    position = _numbers(entry["position"], 3, f"{where} '{name}': position")
    turn = _numbers(entry.get("orientation", [1.0, 0.0, 0.0, 0.0]), 4, f"{where}: orientation")
    length = math.hypot(*turn)
    if abs(length - 1.0) > 1e-3:
        raise InputError(
            f"{where} '{name}': orientation has length {length:.4g}, expected a unit quaternion "
            "(w, x, y, z)"
        )
    if abs(length - 1.0) > 1e-12:
        turn = tuple(x / length for x in turn)
    x, y, z = position
    qw, qx, qy, qz = turn
    return (x, y, z), (qw, qx, qy, qz)


def _numbers(value: object, count: int, where: str) -> tuple[float, ...]:
    good = (
        isinstance(value, list)
        and len(value) == count
        and all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in value)
        and all(math.isfinite(x) for x in value)
    )
    if not good or not isinstance(value, list):
        raise InputError(f"{where} must be {count} numbers in a list")
    return tuple(float(x) for x in value)

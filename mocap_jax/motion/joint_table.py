"""Joint positions of somebody's own skeleton, read from JSON, NPZ or CSV files."""

from __future__ import annotations

import csv
import json
import os
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.motion.npz_arrays import read_arrays
from mocap_jax.motion.text_file import read_text

SUFFIXES = (".json", ".npz", ".csv")
"""Kinds of files that hold a skeleton of joint positions."""
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Metres per unit of length."""
_COLUMNS = ("joint", "parent", "x", "y", "z")
# What else the arrays may be called: statistical models call joints J and parents kintree_table.
_KEYS = {
    "joints": ("joints", "names", "joint_names"),
    "parents": ("parents", "kintree_table"),
    "positions": ("positions", "J"),
}


@dataclass(frozen=True)
class JointTable:
    """Joints as they stand in a file."""

    path: Path
    names: tuple[str, ...] | None
    """None where the file has none."""
    parents: tuple[str, ...] | None
    """Name or number of each joint's parent as text, empty for the root; None without any."""
    positions: Float[np.ndarray, "n 3"]
    """In the file's axes and unit."""
    unit: str


def read_joint_table(path: Path) -> JointTable:
    """Read a file by its suffix; see `load_skeleton` for what it holds.

    Raises:
        InputError: naming the file and the fault.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"{path}: unknown kind of skeleton '{path.suffix}'; valid: {', '.join(SUFFIXES)}"
        )
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    if suffix == ".csv":
        return _read_csv(path)
    return _table(path, _read_json(path) if suffix == ".json" else _read_npz(path))


def holds_joints(path: str | os.PathLike[str]) -> bool:
    """Whether a file is an archive (.npz) of joint positions; motions are archives, too."""
    if Path(path).suffix.lower() != ".npz":
        return False
    try:
        with np.load(path, allow_pickle=False) as archive:
            return any(key in archive for key in _KEYS["positions"])
    except (ValueError, OSError, zipfile.BadZipFile, EOFError):
        return False


def _read_json(path: Path) -> dict:
    try:
        document = json.loads(read_text(path))
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON: {error}") from error
    if not isinstance(document, dict):
        raise InputError(f"{path}: expected an object with joints, parents and positions")
    return document


def _read_npz(path: Path) -> dict:
    wanted = [k for keys in (*_KEYS.values(), ("unit",)) for k in keys]
    return {k: array.tolist() for k, array in read_arrays(path, wanted).items()}


def _read_csv(path: Path) -> JointTable:
    rows = [r for r in csv.reader(read_text(path).splitlines()) if any(c.strip() for c in r)]
    header = [c.strip().lower() for c in rows[0]]
    if missing := [c for c in _COLUMNS if c not in header]:
        raise InputError(
            f"{path}: no column '{missing[0]}'; the first line must name {', '.join(_COLUMNS)}"
        )
    at = [header.index(c) for c in _COLUMNS]
    names, parents, places = [], [], []
    for number, row in enumerate(rows[1:], start=2):
        if len(row) <= max(at):
            raise InputError(
                f"{path}: row {number} has {len(row)} of the {len(header)} values that the first "
                "line names"
            )
        name, parent, *place = (row[i].strip() for i in at)
        names.append(name)
        parents.append(parent)
        places.append(place)
    return _checked(path, names, parents, places, "m")


def _table(path: Path, document: dict) -> JointTable:
    """A table from entries by name."""
    found = {what: _entry(document, keys) for what, keys in _KEYS.items()}
    if found["positions"] is None:
        raise InputError(f"{path}: no 'positions' (one x, y, z a joint)")
    unit = str(document.get("unit", "m"))
    if unit not in UNITS:
        raise InputError(f"{path}: {unknown_name('unit', unit, UNITS)}")
    for what in ("joints", "parents"):
        if found[what] is not None and not isinstance(found[what], list):
            raise InputError(f"{path}: '{what}' must be a list, one entry a joint")
    parents = found["parents"]
    if isinstance(parents, list) and parents and isinstance(parents[0], list):
        parents = parents[0]  # kintree_table: parents above children
    return _checked(path, found["joints"], parents, found["positions"], unit)


def _entry(document: dict, keys: tuple[str, ...]) -> object:
    return next((document[key] for key in keys if key in document), None)


def _checked(
    path: Path, names: object, parents: object, positions: object, unit: str
) -> JointTable:
    try:
        places = np.array(positions, float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: positions must be numbers, x, y, z a joint: {error}") from error
    if places.ndim != 2 or places.shape[1] != 3 or not len(places):
        raise InputError(f"{path}: positions have shape {places.shape}, expected (joints, 3)")
    bad = np.flatnonzero(~np.isfinite(places).all(axis=1))
    if bad.size:
        raise InputError(f"{path}: the position of joint {bad[0]} is not finite")
    texts = []
    for what, values in (("joints", names), ("parents", parents)):
        if values is not None and len(values) != len(places):  # type: ignore[arg-type]
            raise InputError(
                f"{path}: {len(values)} {what}, but {len(places)} positions"  # type: ignore[arg-type]
            )
        texts.append(None if values is None else tuple(_text(v) for v in values))  # type: ignore[attr-defined]
    return JointTable(path, texts[0], texts[1], places, unit)


def _text(value: object) -> str:
    """A name, or a number as text; nothing for the root's parent (None, -1 or its like)."""
    if value is None:
        return ""
    if isinstance(value, (int, float)):
        # Unsigned files have 2^32 - 1 for -1.
        return "" if value < 0 or value >= 2**31 else str(int(value))
    text = str(value).strip()
    return "" if text == "-1" else text

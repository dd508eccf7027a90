"""Checked values out of TOML tables; every fault names the file and the key."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from mocap_jax.errors import InputError, unknown_name


def setup_text(path: str | os.PathLike[str]) -> str:
    """The text of a set-up file.

    Raises:
        InputError: the file is missing, cannot be read or is not text.
    """
    try:
        return Path(path).read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such set-up file") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file, so not TOML") from error
    except OSError as error:
        raise InputError(f"{path}: cannot read: {error.strerror}") from error


def known_keys(table: dict[str, Any], valid: Iterable[str], name: str, where: str) -> None:
    """Refuse keys that are not among the valid ones of a table (`where`, "" for the file)."""
    for key in table:
        if key not in valid:
            place = f" in [{where}]" if where else ""
            raise InputError(f"{name}: {unknown_name(f'key{place}', key, valid)}")


def sub_table(table: dict[str, Any], key: str, name: str) -> dict[str, Any]:
    """The table under a key; empty where there is none."""
    value = table.get(key, {})
    if not isinstance(value, dict):
        raise InputError(f"{name}: '{key}' must be a table ([{key}])")
    return value


def number(value: Any, name: str, key: str, above: float | None = None) -> float:
    """A number, greater than `above` if that is given."""
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise InputError(f"{name}: '{key}' must be a number, not {value!r}")
    if above is not None and not value > above:
        raise InputError(f"{name}: '{key}' must be greater than {above:g}, not {value:g}")
    return float(value)


def triple(
    value: Any, name: str, key: str, above: float | None = None
) -> tuple[float, float, float]:
    """Three numbers, one for each axis."""
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"{name}: '{key}' must be a list of three numbers (x, y, z)")
    x, y, z = (number(v, name, f"{key}[{i}]", above) for i, v in enumerate(value))
    return x, y, z

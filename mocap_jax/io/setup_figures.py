"""Figures of sensors in set-up files: noise and calibration, read and brought up to date.

A set-up file is either kind that users write: a recording's set-up (docs/setup_toml.md) or a suit
for `simulate`. Both may hold the tables `[noise]` and `[calibration]`, and only these matter here.
"""

from __future__ import annotations

import dataclasses
import os
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomlkit

from mocap_jax.errors import InputError
from mocap_jax.io.atomic import atomic_file
from mocap_jax.io.calibration_toml import calibration_from_table, calibration_to_table
from mocap_jax.io.setup_toml import SETUP_KEYS, noise_from_table
from mocap_jax.io.toml_values import known_keys, setup_text, sub_table
from mocap_jax.recording import Calibration, SourceOffset
from mocap_jax.recording.calibration import same_source

_SUIT_KEYS = ("layout", "boards", "anchors")


@dataclass(frozen=True)
class SetupFigures:
    """What a set-up file says of the sensors."""

    calibration: Calibration = field(default_factory=Calibration)
    noise: dict[str, float] = field(default_factory=dict)
    """Standard deviations that the file names, by their names in `NoiseFigures`."""


def read_setup_figures(path: str | os.PathLike[str], *, may_be_empty: bool = False) -> SetupFigures:
    """Read noise and calibration from a set-up file of either kind.

    Args:
        path: the file.
        may_be_empty: a file without any entry is one to be completed, not a mistake.

    Raises:
        InputError: the file is missing, empty or wrong; unknown keys are named with the valid ones.
    """
    table, _ = _parsed(path)
    if not table and not may_be_empty:
        raise InputError(
            f"{path}: the set-up file is empty; expected [noise] or [calibration], which mocap-jax "
            "calibrate writes"
        )
    return _figures(table, str(path))


def update_setup_file(path: str | os.PathLike[str], figures: SetupFigures) -> None:
    """Write figures into a set-up file; all its other entries, and its comments, stay.

    Sensors and sources that the figures do not name keep theirs. The file is made if it is not
    there, and written whole or not at all.

    Raises:
        InputError: what is there is not a set-up file, or cannot be written.
    """
    document = tomlkit.document()
    if Path(path).exists():
        table, document = _parsed(path)
        _figures(table, str(path))
    calibration = dataclasses.replace(
        figures.calibration, applied=False,
        source_offset=_as_named(figures.calibration.source_offset, document),
    )  # fmt: skip
    _merge(document, {"noise": figures.noise, "calibration": calibration_to_table(calibration)})
    # Figures hold for raw readings, whatever the readings beside the old ones were.
    if "calibration" in document:
        document["calibration"].pop("applied", None)  # type: ignore[union-attr]
    text = tomlkit.dumps(document)
    _figures(tomllib.loads(text), str(path))
    with atomic_file(path) as stream:
        stream.write(text.encode())


def _parsed(path: str | os.PathLike[str]) -> tuple[dict[str, Any], tomlkit.TOMLDocument]:
    text = setup_text(path)
    try:
        return tomllib.loads(text), tomlkit.parse(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}") from error


def _figures(table: dict[str, Any], name: str) -> SetupFigures:
    known_keys(table, (*SETUP_KEYS, *_SUIT_KEYS), name, "")
    return SetupFigures(
        calibration_from_table(sub_table(table, "calibration", name), name),
        noise_from_table(sub_table(table, "noise", name), name),
    )


def _as_named(offsets: dict[str, SourceOffset], document: Any) -> dict[str, SourceOffset]:
    """By the names that a document has for the sources, so that none stands in it twice."""
    there = document.get("calibration", {}).get("source_offset", {})
    return {
        name if name in there else next((n for n in there if same_source(n, name)), name): offset
        for name, offset in offsets.items()
    }


def _merge(document: Any, values: dict[str, Any]) -> None:
    """Put nested values into a document; tables that are there are completed, not replaced."""
    for key, value in values.items():
        if isinstance(value, dict):
            if not value:
                continue
            if key not in document:
                document[key] = tomlkit.table(is_super_table=_only_tables(value))
            _merge(document[key], value)
        else:
            document[key] = value


def _only_tables(value: dict[str, Any]) -> bool:
    return all(isinstance(v, dict) for v in value.values())

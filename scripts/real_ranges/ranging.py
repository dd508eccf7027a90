"""NIST and Monash ranges at set distances, as known distances of channels."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from mocap_jax.calibration import KnownDistance

_MONASH_METRES_PER_COUNT = 49 / 78125
"""Of the data's README: counts of 256 / 70 MHz, there and back at 343 m/s."""


def nist(folder: Path) -> list[KnownDistance]:
    """Two-way ranging of two boards: each file has two rows of 100 estimates, channels "row 1" and
    "row 2"; speakers that face up (no free way) are channels of their own.
    """
    from mocap_jax.calibration import KnownDistance

    found = []
    for file in sorted(folder.glob("Ranging_*cm*.csv"), key=_set_distance):
        up = ", facing up" if "FacingUp" in file.name else ""
        for i, row in enumerate(np.loadtxt(file, delimiter=","), 1):
            found.append(KnownDistance(f"row {i}{up}", _set_distance(file), row))
    return found


def monash(folder: Path) -> list[KnownDistance]:
    """Pulse-echo of four channels against a board, some hundred flight times for each distance."""
    from mocap_jax.calibration import KnownDistance

    return [
        KnownDistance(f"channel {i}", _set_distance(file), column * _MONASH_METRES_PER_COUNT)
        for file in sorted((folder / "per_channel").glob("*cm.dat"), key=_set_distance)
        for i, column in enumerate(np.loadtxt(file).T, 1)
    ]


def _set_distance(file: Path) -> float:
    """From the file's name [m]."""
    match = re.search(r"(\d+)cm", file.name)
    if match is None:
        raise ValueError(f"{file.name}: no distance in the name")
    return int(match[1]) / 100

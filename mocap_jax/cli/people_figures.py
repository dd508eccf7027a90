"""The figures of a suit file that several people wear: `simulate --with --sensors SUIT.toml`."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from mocap_jax.io import SetupFigures
    from mocap_jax.simulation import Suit

_Figure = TypeVar("_Figure")


def everybodys_figures(figures: SetupFigures, suit: Suit) -> SetupFigures:
    """Figures of what is worn under the name that it has with each person.

    Names that nobody wears (of anchors, of one person's device, misspelt) stay as they are.

    Args:
        figures: by the names of the file.
        suit: of everybody, as `suits_together` makes it.
    """
    from mocap_jax.recording.calibration import same_source

    boards = {b.name: _unowned(b.name) for b in suit.boards}
    sources = {f"source/{s.name}": f"source/{_unowned(s.name)}" for s in suit.sources}
    given = figures.calibration
    in_room = {
        name: offset
        for name, offset in given.source_offset.items()
        if any(same_source(name, a.site) for a in suit.anchors)
    }
    offsets = _copied(given.source_offset, sources, same_source) | in_room
    calibration = dataclasses.replace(
        given,
        accelerometer=_copied(given.accelerometer, boards, str.__eq__),
        gyroscope=_copied(given.gyroscope, boards, str.__eq__),
        accelerometer_noise=_copied(given.accelerometer_noise, boards, str.__eq__),
        gyroscope_noise=_copied(given.gyroscope_noise, boards, str.__eq__),
        source_offset=offsets,
    )
    return dataclasses.replace(figures, calibration=calibration)


def _unowned(name: str) -> str:
    """`belly` of `a/belly`."""
    return name.partition("/")[2]


def _copied(
    table: Mapping[str, _Figure], worn: Mapping[str, str], same: Callable[[str, str], bool]
) -> dict[str, _Figure]:
    """The table with the names of devices in `worn`, which holds what the table may call them."""
    copies: dict[str, _Figure] = {}
    stay: dict[str, _Figure] = {}
    for name, figure in table.items():
        owned = [device for device, called in worn.items() if same(name, called)]
        copies |= dict.fromkeys(owned, figure)
        if not owned:
            stay[name] = figure
    return copies | stay  # what the file says of one person's device goes before

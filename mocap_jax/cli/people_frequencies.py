"""Frequencies of several people's ultrasonic sources: `simulate --with MOTION --frequencies`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.cli.setup_choice import warn_on_stderr

if TYPE_CHECKING:
    from mocap_jax.simulation import Anchor, Suit

FREQUENCIES = (40_000.0, 33_000.0, 47_000.0)
"""To choose from [Hz]: the bands of neighbours pass little of each other (docs/raw.md)."""


def tuned(
    suits: dict[str, Suit], anchors: tuple[Anchor, ...], asked: tuple[float, ...] | None
) -> dict[str, Suit]:
    """Everybody's sources at their own frequency.

    Without `asked`, the first person's stay as they are, and each of the others gets the first of
    `FREQUENCIES` that is apart from all before and from the anchors'. Where none is left, it is the
    one that fewest sources have, and a warning says so.

    Args:
        suits: by the names of the people.
        anchors: in the room.
        asked: one for each person [Hz].

    Raises:
        UsageError: frequencies are asked for where nothing sounds.
    """
    if asked:
        if not any(suit.sources for suit in suits.values()):
            raise UsageError("--frequencies: the suit of --sensors has no ultrasonic sources")
        return {n: _at(suit, f) for (n, suit), f in zip(suits.items(), asked, strict=True)}
    out: dict[str, Suit] = {}
    room = [a.frequency for a in anchors if a.emits]
    crowded = []
    for name, suit in suits.items():
        taken = room + [s.frequency for other in out.values() for s in other.sources]
        if out and suit.sources:
            suit = _at(suit, min(FREQUENCIES, key=lambda f: _crowd(f, taken)))
            crowded += [name] * any(_crowd(suit.sources[0].frequency, taken))
        out[name] = suit
    if crowded:
        warn_on_stderr(_crowded_text(crowded, out, room))
    return out


def _at(suit: Suit, frequency: float) -> Suit:
    """A suit whose sources all have a frequency [Hz]."""
    return replace(suit, sources=tuple(replace(s, frequency=frequency) for s in suit.sources))


def _crowd(frequency: float, taken: list[float]) -> tuple[int, int]:
    """How many sources pass the filter of a frequency [Hz], and how many have that very one.

    The latter take turns with each other, which costs time only.
    """
    from mocap_jax.signals.ultrasonic.bands import APART_HZ

    return sum(0 < abs(frequency - f) < APART_HZ for f in taken), taken.count(frequency)


def _crowded_text(crowded: list[str], suits: dict[str, Suit], room: list[float]) -> str:
    """Whose frequencies are not their own, and all that there are."""
    from mocap_jax.signals.ultrasonic.bands import APART_HZ

    have = {name: [s.frequency for s in suit.sources] for name, suit in suits.items()}
    told = [f"{name} {_listed(f)}" for name, f in {**have, "anchors": room}.items() if f]
    return (
        f"--with: none of {_listed(FREQUENCIES, ', ')} Hz is left for {' and '.join(crowded)}: "
        f"sources of one frequency take turns, others need {APART_HZ:g} Hz between them; now [Hz]: "
        f"{', '.join(told)}; say others by --frequencies"
    )


def _listed(frequencies: Iterable[float], between: str = " and ") -> str:
    return between.join(f"{f:g}" for f in dict.fromkeys(frequencies))

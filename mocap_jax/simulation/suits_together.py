"""The suits of several people as one (see `motion.together`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from mocap_jax.simulation.suit import Anchor, Mounting, Suit


def suits_together(suits: Mapping[str, Suit], anchors: tuple[Anchor, ...] = ()) -> Suit:
    """One suit of all: devices and segments with their wearer's name in front.

    Args:
        suits: by the names of the people. Sources of different frequencies (`Mounting.frequency`)
            sound at the same time; those of one frequency take turns.
        anchors: in the world, besides those of the suits, whose names get the prefix too.
    """

    def worn(person: str, device: Mounting) -> Mounting:
        return replace(device, name=f"{person}/{device.name}", segment=f"{person}/{device.segment}")

    return Suit(
        tuple(worn(p, b) for p, s in suits.items() for b in s.boards),
        tuple(worn(p, x) for p, s in suits.items() for x in s.sources),
        tuple(f"{p}: {text}" for p, s in suits.items() for text in s.omitted),
        tuple(replace(a, name=f"{p}/{a.name}") for p, s in suits.items() for a in s.anchors)
        + anchors,
    )

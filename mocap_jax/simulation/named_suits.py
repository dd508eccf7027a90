"""Suits of inertial boards alone, by name: places of the standard suit."""

from __future__ import annotations

from mocap_jax.body import Body
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.simulation.default_suit import default_suit
from mocap_jax.simulation.suit import Suit

_ENDS = ("left_forearm", "right_forearm", "left_shank", "right_shank")
VALIDATION = ("left_thigh", "right_thigh", "left_upper_arm", "right_upper_arm")
"""Boards that the Sparse Inertial Poser was validated with (von Marcard 2017, section 5.3)."""
SUITS: dict[str, tuple[str, ...]] = {
    # Lower legs, wrists, head and back (von Marcard 2017, figure 3).
    "sip6_head": ("pelvis", "head", *_ENDS),
    # Lower legs, lower arms, waist and chest (section 5.3), and with the ones that validate.
    "sip6_tnt15": ("pelvis", "chest", *_ENDS),
    "tnt15": ("pelvis", "chest", *_ENDS, *VALIDATION),
}
"""Names of the boards of each suit."""


def named_suit(name: str, body: Body) -> Suit:
    """A suit of `SUITS` fitted to a body.

    Raises:
        InputError: no such suit, or a body that lacks a segment it needs.
    """
    if name not in SUITS:
        raise unknown_name("suit", name, SUITS)
    standard = {board.name: board for board in default_suit(body).boards}
    missing = [board for board in SUITS[name] if board not in standard]
    if missing:
        raise InputError(
            f"suit '{name}': the body has no segment for {', '.join(missing)}; give a set-up file"
        )
    return Suit(tuple(standard[board] for board in SUITS[name]))

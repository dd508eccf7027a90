"""Numbers in the text of an MJCF document (MuJoCo's own writer rounds them)."""

from __future__ import annotations

from collections.abc import Iterable


def numbers(values: Iterable[float]) -> str:
    """Shortest text that reads back as the same doubles; zero has no sign."""
    return " ".join(repr(float(v) + 0.0) for v in values)

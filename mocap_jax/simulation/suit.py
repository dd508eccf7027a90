"""`Suit`: which boards and ultrasonic sources are worn, and where on which segment."""

from __future__ import annotations

from dataclasses import dataclass

SOURCE_PREFIX = "source/"


@dataclass(frozen=True)
class Mounting:
    """One device fixed to a segment."""

    name: str
    """Of the board or the source (sources without the `source/` of their site)."""
    segment: str
    """Body of the MJCF, or its Xsens name."""
    position: tuple[float, float, float]
    """In the segment's frame [m]."""
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    """R_segment_device (wxyz). z points away from the skin; of a source it is the emission axis."""


@dataclass(frozen=True)
class Suit:
    """Boards (each an accelerometer, a gyroscope and a microphone) and ultrasonic sources."""

    boards: tuple[Mounting, ...]
    sources: tuple[Mounting, ...] = ()
    """In firing order."""
    omitted: tuple[str, ...] = ()
    """Devices of a standard layout that the body has no segment for, one sentence each."""

    @property
    def source_sites(self) -> tuple[str, ...]:
        """Site names of the sources, in firing order."""
        return tuple(SOURCE_PREFIX + s.name for s in self.sources)

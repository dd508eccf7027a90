"""`Suit`: which boards and ultrasonic sources are worn, and which anchors stand in the world."""

from __future__ import annotations

from dataclasses import dataclass

from mocap_jax.body.site_names import ANCHOR_PREFIX, SOURCE_PREFIX

BURST_HZ = 40_000.0
"""Of ultrasonic bursts, unless something else is said (Vlasic 2007, section 3.2)."""


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
    frequency: float = BURST_HZ
    """Of a source's bursts [Hz]; boards, which hear all frequencies, have none."""


@dataclass(frozen=True)
class Anchor:
    """One ultrasonic device fixed in the world."""

    name: str
    """Without the `anchor/` of its site."""
    position: tuple[float, float, float]
    """In the world [m]."""
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    """R_world_anchor (wxyz); z is the axis of emission or reception."""
    emits: bool = False
    """A source; otherwise a receiver."""
    frequency: float = BURST_HZ
    """Of the bursts of one that emits [Hz]."""

    @property
    def site(self) -> str:
        """Name of its site."""
        return ANCHOR_PREFIX + self.name


@dataclass(frozen=True)
class Suit:
    """Boards (each an accelerometer, a gyroscope and a microphone) and ultrasonic sources."""

    boards: tuple[Mounting, ...]
    sources: tuple[Mounting, ...] = ()
    """In firing order."""
    omitted: tuple[str, ...] = ()
    """Devices of a standard layout that the body has no segment for, one sentence each."""

    anchors: tuple[Anchor, ...] = ()
    """Receivers and sources that stand in the world."""

    @property
    def worn_sites(self) -> tuple[str, ...]:
        """Site names of what is worn: boards, then sources."""
        return (*(b.name for b in self.boards), *(SOURCE_PREFIX + s.name for s in self.sources))

    @property
    def source_sites(self) -> tuple[str, ...]:
        """Site names of the sources, in firing order; anchors come last."""
        worn = tuple(SOURCE_PREFIX + s.name for s in self.sources)
        return worn + tuple(a.site for a in self.anchors if a.emits)

    @property
    def frequencies(self) -> tuple[float, ...]:
        """Of the bursts of all sources [Hz], as `source_sites`. Those of one frequency take turns,
        while those of others sound: receivers tell them apart by their band-pass filters."""
        worn = tuple(s.frequency for s in self.sources)
        return worn + tuple(a.frequency for a in self.anchors if a.emits)

    @property
    def listening_anchors(self) -> tuple[str, ...]:
        """Site names of the anchors that receive."""
        return tuple(a.site for a in self.anchors if not a.emits)

    @property
    def receiver_names(self) -> tuple[str, ...]:
        """Boards, then the anchors that receive."""
        return tuple(b.name for b in self.boards) + self.listening_anchors

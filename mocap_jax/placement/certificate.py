"""`Certificate`: how good a choice of segments, or of sources, provably is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Certificate:
    """What is known about the best choice of candidates, each at its place."""

    value: float
    """Criterion of the choice."""
    bound: float
    """No choice has a smaller one; 0 where nothing is proven."""
    evaluated: int
    """Choices evaluated exactly."""
    exhaustive: bool
    """All choices that the constraints allow were evaluated."""
    dropped: int = 0
    """Better choices evaluated that are left out: no places far enough apart were found."""

    @property
    def gap(self) -> float:
        """How much better the best choice may be, at most, relative to the value."""
        return 1.0 - self.bound / self.value

    @property
    def sentence(self) -> str:
        """For people."""
        left = ""
        if self.dropped:
            left = f" but {self.dropped} better, left out for the least distance between sensors"
        if self.exhaustive:
            return f"best of all {self.evaluated} choices (exhaustive search){left}"
        found = f"best of {self.evaluated} choices evaluated{left}"
        if not self.dropped:  # exchanges were those of the best of all
            found += ", no exchange of one for another found better"
        if self.bound <= 0.0:
            return f"{found}; nothing is proven of the others"
        proven = f"relaxation proves that none is better by more than {100 * self.gap:.0f} %"
        return f"{found}; {proven}"

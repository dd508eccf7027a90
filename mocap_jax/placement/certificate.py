"""`Certificate`: how good a choice of segments provably is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Certificate:
    """What is known about the best choice of segments among the candidates' places."""

    value: float
    """Criterion of the choice."""
    bound: float
    """No choice has a smaller one; 0 where nothing is proven."""
    evaluated: int
    """Choices evaluated exactly."""
    exhaustive: bool
    """All choices that the constraints allow were evaluated."""

    @property
    def gap(self) -> float:
        """How much better the best choice may be, at most, relative to the value."""
        return 1.0 - self.bound / self.value

    @property
    def sentence(self) -> str:
        """For people."""
        if self.exhaustive:
            return f"best of all {self.evaluated} choices (exhaustive search)"
        found = (
            f"best of {self.evaluated} choices evaluated, no exchange of one segment found better"
        )
        if self.bound <= 0.0:
            return f"{found}; no bound for this objective"
        proven = f"relaxation proves that none is better by more than {100 * self.gap:.0f} %"
        return f"{found}; {proven}"

"""`Metric`: one measured figure and what it should be."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True)
class Metric:
    """A figure with its unit, direction and target."""

    name: str
    value: float
    unit: str
    better: Literal["lower", "higher"]
    target: float
    context: dict[str, Any]
    """What was measured: frames, degrees of freedom, boards, parts of the figure."""

    @property
    def met(self) -> bool:
        """Whether the value reaches the target; a value that is not finite does not."""
        if not math.isfinite(self.value):
            return False
        return self.value <= self.target if self.better == "lower" else self.value >= self.target

    def as_json(self) -> dict[str, Any]:
        """The metric as JSON holds it."""
        return dataclasses.asdict(self) | {"met": self.met}

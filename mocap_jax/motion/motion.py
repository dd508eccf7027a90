"""`Motion`: a known motion of a known body, from a file or built in."""

from __future__ import annotations

from dataclasses import dataclass, field

from mocap_jax.body import Body
from mocap_jax.trajectory import Trajectory


@dataclass(frozen=True)
class Motion:
    """Poses of a body over time, uniformly sampled, Z up, metres."""

    name: str
    body: Body
    """With a free root as its first joint."""
    trajectory: Trajectory
    facts: dict[str, str | float | int | bool] = field(default_factory=dict)
    """Where it came from: file, frame rate, scale, skipped rows, retargeting error, ..."""

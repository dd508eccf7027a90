"""`Recording`: everything one session measured and declared, and its truth if it was simulated."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import jax
import numpy as np

from mocap_jax.recording.setup import Setup
from mocap_jax.recording.streams import (
    InertialStream,
    MagneticStream,
    RangeStream,
    RootStream,
    TemperatureStream,
)
from mocap_jax.trajectory import Trajectory


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Truth:
    """What really happened (simulated recordings only); never read by an estimator."""

    trajectory: Trajectory
    """Of the true body, at its own times."""
    body_xml: str = dataclasses.field(metadata={"static": True})
    """The true body: real segment lengths and sensor mounting."""
    parameters: dict[str, jax.Array] = dataclasses.field(default_factory=dict)
    """True nuisance values by name, e.g. `gyroscope_bias/<sensor>` (3,)."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Recording:
    """One recording. Streams are keyed by sensor name."""

    inertial: dict[str, InertialStream]
    ranges: RangeStream | None
    root: RootStream | None
    magnetic: dict[str, MagneticStream]
    temperature: TemperatureStream | None
    truth: Truth | None
    setup: Setup = dataclasses.field(metadata={"static": True})
    body_xml: str | None = dataclasses.field(metadata={"static": True})
    """The nominal body with its mounted sites (attachment `body.xml`)."""
    start_utc_ns: int = dataclasses.field(default=0, metadata={"static": True})
    subject: str = dataclasses.field(default="", metadata={"static": True})
    salvage: tuple[str, ...] = dataclasses.field(default=(), metadata={"static": True})
    """What was lost when the file was read, one sentence each; empty when nothing was."""

    @property
    def interval(self) -> tuple[float, float]:
        """First and last time of any measurement [s]."""
        streams = [*self.inertial.values(), *self.magnetic.values(), self.ranges, self.root]
        # In NumPy: JAX would compile an indexing operation for every length.
        times = [np.asarray(s.time) for s in streams if s is not None and len(s.time)]
        return (
            float(min(t[0] for t in times)) if times else 0.0,
            float(max(t[-1] for t in times)) if times else 0.0,
        )

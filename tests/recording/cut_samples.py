"""Ten seconds of everything, whose values say which sample they belong to."""

from __future__ import annotations

import numpy as np

from mocap_jax.recording import (
    InertialStream,
    MagneticStream,
    RangeStream,
    Recording,
    RestHold,
    RootStream,
    SensorSpec,
    Setup,
    TemperatureStream,
    Truth,
)
from mocap_jax.trajectory import Trajectory


def rows(time: np.ndarray, width: int) -> np.ndarray:
    """Values that say which sample they belong to."""
    return time[:, None] + 1000.0 * np.arange(width)


def recording(rest: RestHold | None = RestHold(0.0, 2.0)) -> Recording:  # noqa: B008
    """Ten seconds of everything, each stream with a rate of its own."""
    fast, slow = np.arange(1000) / 100 + 0.005, np.arange(5) * 2.5
    early = fast[fast < 3]
    pulses = np.arange(500) * 0.02
    return Recording(
        inertial={
            "chest": InertialStream(fast, rows(fast, 3), rows(fast, 3), rows(fast, 4)),
            "broken": InertialStream(early, rows(early, 3), rows(early, 3), rows(early, 4)),
        },
        ranges=RangeStream(
            pulses, np.arange(500) % 2, np.zeros(500, int), pulses, 0 * pulses, ("a", "b"), ("c",)
        ),
        root=RootStream(fast[::2], rows(fast[::2], 3), rows(fast[::2], 4)),
        magnetic={"chest": MagneticStream(fast[::4], rows(fast[::4], 3))},
        temperature=TemperatureStream(slow, 20 + slow),
        truth=Truth(
            Trajectory(pulses, rows(pulses, 7)), "<mujoco/>",
            {"bias": np.arange(3.0), "wobble": rows(pulses, 3)},
        ),
        setup=Setup(
            sensors=(SensorSpec("chest", "chest", 100.0), SensorSpec("broken", "broken", 100.0)),
            rest=rest, score_from=3.0, provenance={"motion": "walk"},
        ),
        body_xml="<mujoco/>", start_utc_ns=12, subject="a",
    )  # fmt: skip

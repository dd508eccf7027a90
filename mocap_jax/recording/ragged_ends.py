"""`ragged_ends`: sensors that start after the others or end before them."""

from __future__ import annotations

import numpy as np

from mocap_jax.recording.recording import Recording

# Told beyond this time [s] and this many samples.
_LEAST, _SAMPLES = 0.1, 5


def ragged_ends(recording: Recording) -> tuple[str, ...]:
    """Inertial streams that do not cover the recording, in sentences; empty where all do.

    What is missing at an end leaves no gap between samples, and no count of them shows it.
    """
    streams = {n: np.asarray(s.time) for n, s in recording.inertial.items() if len(s.time) > 1}
    if len(streams) < 2:
        return ()
    first = min(float(t[0]) for t in streams.values())
    last = max(float(t[-1]) for t in streams.values())
    late: dict[str, list[str]] = {}
    for name, time in streams.items():
        least = max(_LEAST, _SAMPLES * float(np.median(np.diff(time))))
        for missing, what in (
            (float(time[0]) - first, f"start at {time[0]:.2f} s, after others at {first:.2f} s"),
            (last - float(time[-1]), f"end at {time[-1]:.2f} s, before others at {last:.2f} s"),
        ):
            if missing > least:
                late.setdefault(what, []).append(name)
    return tuple(
        f"Sensor{'s' * (len(names) > 1)} {', '.join(names)}: samples {what}."
        for what, names in late.items()
    )

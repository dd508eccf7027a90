"""Whether confidences say how good distances are: a person who moves in a room with echoes."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from clips import load_clip

from mocap_jax.decoding import decode_raw
from mocap_jax.signals.ultrasonic.arrivals import DetectorOptions
from mocap_jax.simulation.raw import RawSimulation, simulate_raw

WRONG_M = 0.01
EDGES = (0.0, 0.05, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)


@dataclass(frozen=True)
class Heard:
    """n decoded distances beside the truth."""

    error: np.ndarray
    """Of the distance, with the true speed of sound and offsets [m]."""
    confidence: np.ndarray
    visible: np.ndarray
    """Whether the direct way was free."""
    nominal: float
    """Declared deviation at full confidence [m]."""

    def wrong(self, least: float) -> tuple[int, int]:
        """How many of what is trusted more are wrong by more than 10 mm, and how many these are."""
        trusted = self.confidence > least
        return int((np.abs(self.error[trusted]) > WRONG_M).sum()), int(trusted.sum())

    def bins(self) -> list[tuple[float, float, int, float, float, float]]:
        """By confidence: edges, count, share right, expected and found deviation [m].

        The deviation found is that of a normal distribution with the same median of |error|.
        """
        rows = []
        for low, high in zip(EDGES[:-1], EDGES[1:], strict=True):
            here = (self.confidence > low) & (self.confidence <= high)
            if not here.any():
                continue
            error = np.abs(self.error[here])
            expected = float(np.median(self.nominal / self.confidence[here]))
            rows.append((low, high, int(here.sum()), float((error <= WRONG_M).mean()), expected,
                         float(np.median(error)) / 0.6745))  # fmt: skip
        return rows


def heard(detector: str, clip: str, profile: str, seconds: float, seed: int) -> Heard:
    """Simulate the wires of a moving person, decode, compare."""
    raw = simulate_raw(load_clip(clip, seconds), profile=profile, seed=seed)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "raw.mcap"
        raw.write(file)
        recording = decode_raw(file, DetectorOptions(detector=detector)).recording
    ranges = recording.ranges
    assert ranges is not None
    pulse = np.searchsorted(raw.pulse_time, np.asarray(ranges.time) - 1e-6)
    receiver = np.asarray(ranges.receiver)
    speed, offset = _truth(raw)
    scale = speed / recording.setup.speed_of_sound
    true = raw.distance[pulse, receiver]
    error = np.asarray(ranges.distance) * scale - offset[np.asarray(ranges.source)] - true
    return Heard(
        error, np.asarray(ranges.confidence), raw.visible[pulse, receiver],
        recording.setup.noise.range,
    )  # fmt: skip


def _truth(raw: RawSimulation) -> tuple[float, np.ndarray]:
    """True speed of sound [m/s] and excess of each source's distances [m]."""
    truth = raw.recording.truth
    assert truth is not None
    speed = float(truth.parameters["speed_of_sound"])
    names = [f"source_offset/{s.removeprefix('source/')}" for s in raw.recording.setup.sources]
    late = np.array([float(truth.parameters[name]) for name in names])
    return speed, late * speed / raw.recording.setup.speed_of_sound

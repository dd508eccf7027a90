"""Arrivals at all microphones to distances with confidences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.signals.ultrasonic.air import absorption, temperature
from mocap_jax.signals.ultrasonic.burst import CARRIER_HZ
from mocap_jax.signals.ultrasonic.confidence import continuity_confidence, signal_confidence


@dataclass(frozen=True)
class DetectionFigures:
    """Thresholds of w_s and w_t; see `confidence`. Amplitudes are relative to the reference."""

    noise: float = 0.02
    """Noise amplitude, where the wire's own is not given."""
    gate: float = 4.0
    """Noise amplitudes that a peak must exceed."""
    strength_threshold: float = 0.08
    """Normalised power above which w_s is 1."""
    strength_scale: float = 0.03
    """Width of the fall of w_s below the threshold, as a share of it."""
    closing_speed: float = 3.0
    """Change of distance that w_t takes for continuous [m/s]."""
    jump_scale: float = 0.3
    """Jump beyond that at which w_t reaches 0 [m]."""
    memory_s: float = 0.2
    """Older distances say nothing about continuity [s]."""


@dataclass(frozen=True)
class Distances:
    """Of n pulses and r microphones; NaN and confidence 0 where nothing was heard."""

    distance: Float[np.ndarray, "n r"]
    """[m]"""
    confidence: Float[np.ndarray, "n r"]


def measure(
    time: Float[np.ndarray, "n"],
    source: np.ndarray,
    delay: Float[np.ndarray, "n r"],
    amplitude: Float[np.ndarray, "n r"],
    speed: Float[np.ndarray, "n"] | Float[np.ndarray, "n r"],
    offset: Float[np.ndarray, "s"],
    figures: DetectionFigures | None = None,
    *,
    farthest: float | Float[np.ndarray, "s r"] = 2.75,
    deviation: Float[np.ndarray, "n r"] | None = None,
    nominal: float = 0.0025,
    frequency: float | Float[np.ndarray, "s"] = CARRIER_HZ,
) -> Distances:
    """Distances and their confidences w_s w_t.

    A detected sound that is too faint in the noise for the nominal deviation of a distance lowers
    w_s as estimators understand it: they divide the nominal deviation by the confidence.

    Args:
        time: of emission [s].
        source: index of each pulse's source.
        delay: times of flight, NaN where nothing was heard [s].
        amplitude: relative to the direct sound on the axis at 1 m.
        speed: of sound, at each pulse, for all microphones or for each [m/s].
        offset: calibrated excess of each source's distances [m].
        figures: thresholds.
        farthest: longer distances are not believed [m]; of all pairs or of each.
        deviation: of the times of flight, from noise alone [s]; None takes them for exact.
        nominal: deviation of a distance with confidence 1 [m].
        frequency: of the bursts [Hz]; of all sources or of each.
    """
    figures = DetectionFigures() if figures is None else figures
    speed = speed if speed.ndim == 2 else speed[:, None]
    distance = speed * delay - offset[source][:, None]
    longest = farthest if np.isscalar(farthest) else np.asarray(farthest)[source]
    distance[~((distance > 0) & (distance <= longest))] = np.nan
    heard = np.isfinite(distance)
    # What air absorbs is made up for, so that far sources are not taken for hidden ones.
    loss = _absorbed(np.broadcast_to(frequency, len(offset)), speed)[source][:, None]
    way = np.where(heard, distance, 0.0)
    level = np.where(heard, amplitude, 0.0)
    strength = signal_confidence(level * 10.0 ** (loss * (way - 1.0) / 20.0), way, figures)
    continuity = continuity_confidence(time, source, way, strength, figures)
    if deviation is not None:
        excess = np.where(heard, speed * deviation / nominal, 0.0)
        strength = strength / np.sqrt(1.0 + excess**2)
    return Distances(distance, np.where(heard, strength * continuity, 0.0))


def _absorbed(
    frequency: Float[np.ndarray, "s"], speed: Float[np.ndarray, "n r"]
) -> Float[np.ndarray, "s"]:
    """What air absorbs of each source's sound [dB/m]."""
    if not speed.size:
        return np.zeros(len(frequency))
    celsius = float(temperature(speed.mean()))
    return np.array([float(absorption(f, celsius)) for f in frequency])

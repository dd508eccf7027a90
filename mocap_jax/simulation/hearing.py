"""What a microphone's detector reports: a distance and its confidence w_s w_t.

The detector sees amplitudes only. True angles and occlusion shape the sound that arrives, but the
confidence is computed from the detected peak and from past distances, as in a real decoder
(`signal_confidence`, `continuity_confidence`). Amplitudes are relative to the direct sound on the
emission axis at 1 m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from mocap_jax.signals.ultrasonic.confidence import continuity_confidence, signal_confidence
from mocap_jax.simulation.flight import Flights


@dataclass(frozen=True)
class HearingFigures:
    """The acoustic channel and the detector."""

    noise: float = 0.02
    """Ambient noise amplitude after the band-pass (34 dB below the direct sound at 1 m)."""
    gate: float = 4.0
    """Peaks below this many noise amplitudes are not heard (Vlasic 2007, 4.1: 'well above')."""
    resolution_cells: float = 40.0
    """Independent noise peaks in one 8 ms slot behind the 5 kHz band-pass: 8 ms x 5 kHz."""
    beam: float = 1.5
    """Directivity ((1 + cos angle) / 2)^beam: -9 dB at 90 degrees, as of small open 40 kHz
    transducers; nothing is heard directly beyond 90 degrees."""
    fading: float = 0.1
    """Relative variation of the amplitude from pulse to pulse."""
    leak: tuple[float, float] = (0.02, 0.10)
    """Amplitude diffracted around an obstacle, relative to the direct sound."""
    detour: float = 0.03
    """Mean extra way of diffracted sound [m]."""
    echo: tuple[float, float] = (0.02, 0.20)
    """Amplitude of the strongest reflection, relative to a direct path of its length."""
    echo_detour: tuple[float, float] = (0.15, 0.60)
    """Extra way of a reflection: smallest and mean of the rest [m] (floor, walls, own limbs)."""
    strength_threshold: float = 0.08
    """Normalised power above which w_s is 1 (that of the beam's edge is 0.125)."""
    strength_scale: float = 0.03
    """Width of the fall of w_s below the threshold, as a share of it."""
    closing_speed: float = 3.0
    """Change of distance that w_t takes for continuous [m/s]; fast arms reach it."""
    jump_scale: float = 0.3
    """Jump beyond that at which w_t reaches 0 [m]."""
    memory_s: float = 0.2
    """Heard distances older than this say nothing about continuity [s]."""


@dataclass(frozen=True)
class HeardRanges:
    """Detections of n pulses at r microphones."""

    path: Float[np.ndarray, "n r"]
    """Length of the way of the detected sound [m]."""
    jitter: Float[np.ndarray, "n r"]
    """Factor of the range noise: 1 for strong peaks, larger for weak ones."""
    confidence: Float[np.ndarray, "n r"]
    direct: Bool[np.ndarray, "n r"]
    """The direct sound was detected (told to no estimator)."""


def hear(
    flights: Flights,
    figures: HearingFigures,
    rng: np.random.Generator,
    *,
    max_range: float,
    multipath: float = 0.0,
    multipath_echo: tuple[float, float] = (0.3, 0.8),
) -> HeardRanges:
    """Simulate the detection of the earliest audible peak in every slot.

    Args:
        flights: true direct paths.
        figures: channel and detector.
        rng: random stream.
        max_range: longest way heard within a slot [m].
        multipath: share of pulses whose direct sound is lost and whose echo is strong
            (clothing over a microphone beside a reflecting surface).
        multipath_echo: amplitude of such echoes.
    """
    shape = flights.distance.shape
    fading = np.exp(figures.fading * rng.standard_normal(shape))
    beam = np.where(
        flights.cosine > 0, ((1 + np.clip(flights.cosine, 0, 1)) / 2) ** figures.beam, 0.0
    )
    leak = rng.uniform(*figures.leak, shape)
    detour = rng.exponential(figures.detour, shape)
    echo = rng.uniform(*figures.echo, shape)
    shortest, mean = figures.echo_detour
    echo_path = flights.distance + shortest + rng.exponential(mean, shape)
    lost = rng.random(shape) < multipath
    echo = np.where(lost, rng.uniform(*multipath_echo, shape), echo)
    direct_path = flights.distance + np.where(flights.occluded, detour, 0.0)
    gain = np.where(lost, 0.0, np.where(flights.occluded, leak, 1.0))
    noise_path = rng.uniform(0.0, max_range, shape)
    paths = np.stack([direct_path, echo_path, noise_path])
    near = np.maximum(paths, 0.05)
    amplitudes = np.stack(
        [gain * beam * fading / near[0], echo / near[1], _noise_peak(figures, rng, shape)]
    )
    chosen, audible = _earliest(paths, amplitudes, figures.gate * figures.noise, max_range)
    pick = lambda x: np.take_along_axis(x, chosen[None], axis=0)[0]  # noqa: E731
    path, amplitude = pick(paths), np.where(audible, pick(amplitudes), 0.0)
    power = (amplitude * path) ** 2
    strength = signal_confidence(amplitude, path, figures)
    continuity = continuity_confidence(flights.time, flights.source, path, strength, figures)
    jitter = np.sqrt(np.maximum(1.0, figures.strength_threshold / np.maximum(power, 1e-3)))
    direct = audible & (chosen == 0) & ~flights.occluded
    return HeardRanges(path, jitter, strength * continuity, direct)


def _noise_peak(
    figures: HearingFigures, rng: np.random.Generator, shape: tuple[int, ...]
) -> np.ndarray:
    """Largest of the slot's independent Rayleigh-distributed noise peaks."""
    share = rng.random(shape) ** (1.0 / figures.resolution_cells)
    return figures.noise * np.sqrt(-2.0 * np.log(np.maximum(1.0 - share, 1e-12)))


def _earliest(
    paths: np.ndarray, amplitudes: np.ndarray, gate: float, max_range: float
) -> tuple[np.ndarray, np.ndarray]:
    """Index of the earliest peak above the gate, and whether there is one."""
    heard = (amplitudes > gate) & (paths <= max_range)
    chosen = np.where(heard, paths, np.inf).argmin(axis=0)
    return chosen, np.asarray(heard.any(axis=0))

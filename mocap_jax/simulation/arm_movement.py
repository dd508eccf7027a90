"""How a simulated arm moves: flexion and extension, with what a real arm does beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.errors import InputError
from mocap_jax.simulation.random_streams import stream

# Tones that make up a random movement.
_TONES = 24
# Movement fades in over this time after the hold [s].
_FADE = 1.0


@dataclass(frozen=True)
class ArmMovement:
    """Flexion and extension of the elbow while the shoulder goes along."""

    seconds: float = 120.0
    """Of movement, after the hold (the paper's trials last two minutes)."""
    hold: float = 1.0
    """Still hold of the start pose [s]."""
    period: float = 2.5
    """Of one flexion and extension [s]; it varies by a tenth."""
    elbow_deg: tuple[float, float] = (10.0, 125.0)
    """Smallest and largest flexion; extremes vary by 3 degrees."""
    shoulder_deg: tuple[float, float] = (-80.0, -65.0)
    """The same of the upper arm's angle above the horizontal, which follows the elbow."""
    out_of_plane_deg: float = 4.0
    """RMS of abduction and of axial rotation of the upper arm, below 0.6 Hz."""
    vibration: float = 0.002
    """RMS of the mobile's movement on the wrist, per axis, at 4 to 12 Hz [m]."""

    def __post_init__(self) -> None:
        for name in ("seconds", "hold", "period"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name}={getattr(self, name):g}: must be above 0 s")


def arm_poses(
    movement: ArmMovement, time: Float[np.ndarray, "t"], seed: int
) -> Float[np.ndarray, "t 8"]:
    """Shoulder (wxyz), elbow [rad] and the mobile's slides [m] at the given times [s]."""
    fade = np.clip((time - movement.hold) / _FADE, 0.0, 1.0)
    fade = fade**3 * (10 - 15 * fade + 6 * fade**2)
    tones = lambda name, low, high: _tones(time, low, high, stream(seed, f"arm/{name}"))  # noqa: E731
    pace = 1.0 + 0.1 * tones("pace", 0.02, 0.1).clip(-2, 2)
    phase = 2 * np.pi * np.cumsum(fade * pace) * (time[1] - time[0]) / movement.period
    bent = 0.5 - 0.5 * np.cos(phase)
    least, most = movement.elbow_deg
    elbow = least + bent * (most - least + 3.0 * tones("reach", 0.02, 0.1))
    low, high = movement.shoulder_deg
    flexion = low + bent * (high - low) + 2.0 * fade * tones("sway", 0.05, 0.4)
    aside, turned = (
        movement.out_of_plane_deg * fade * tones(name, 0.05, 0.6) for name in ("aside", "turned")
    )
    rotation = _turns("x", aside) * _turns("y", -flexion) * _turns("x", turned)
    shake = np.stack([tones(f"vibration/{axis}", 4.0, 12.0) for axis in "xyz"], axis=1)
    return np.concatenate([
        rotation.as_quat(scalar_first=True), np.deg2rad(elbow)[:, None],
        movement.vibration * fade[:, None] * shake,
    ], axis=1)  # fmt: skip


def _turns(axis: str, degrees: np.ndarray) -> Rotation:
    return Rotation.from_euler(axis, degrees[:, None], degrees=True)


def _tones(
    time: np.ndarray, low: float, high: float, rng: np.random.Generator
) -> Float[np.ndarray, "t"]:
    """Random movement of unit RMS between two frequencies [Hz]."""
    frequency = rng.uniform(low, high, _TONES)
    phase = rng.uniform(0, 2 * np.pi, _TONES)
    waves = np.sin(2 * np.pi * frequency * time[:, None] + phase)
    return waves.sum(axis=1) * np.sqrt(2 / _TONES)

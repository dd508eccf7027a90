"""A box with two boards that is laid down, turned and left alone by the simulator."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from mocap_jax.body import load_body
from mocap_jax.motion import Motion
from mocap_jax.recording import NoiseFigures, Recording
from mocap_jax.simulation import Mounting, Profile, SimulationOptions, Suit, simulate
from mocap_jax.trajectory import Trajectory

BOX = """<mujoco><worldbody><body name="box" pos="0 0 1"><freejoint name="root"/>
<geom type="box" size=".05 .05 .05" mass="1"/></body></worldbody></mujoco>"""
SUIT = Suit((
    Mounting("straight", "box", (0.02, 0.0, 0.05)),
    Mounting("turned", "box", (0.0, 0.05, 0.0), (np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0)),
))  # fmt: skip
LAB = Profile(
    "lab", NoiseFigures(accelerometer=0.02, gyroscope=0.002), gyroscope_bias=0.05,
    accelerometer_bias=0.3, scale=0.02, detector=False,
)  # fmt: skip
SHORT = SimulationOptions(rest_s=0.3, blend_s=0.5)
UP = {
    "+z": Rotation.identity(), "-z": Rotation.from_euler("x", 180, degrees=True),
    "+x": Rotation.from_euler("y", -90, degrees=True),
    "-x": Rotation.from_euler("y", 90, degrees=True),
    "+y": Rotation.from_euler("x", 90, degrees=True),
    "-y": Rotation.from_euler("x", -90, degrees=True),
}  # fmt: skip
"""Orientations of the box with that axis up."""
_RATE = 100


def _record(turns: Rotation, seed: int, profile: Profile = LAB) -> Recording:
    body = load_body(BOX)
    q = np.zeros((len(turns), 7))
    q[:, 2] = 1.0
    q[:, 3:] = turns.as_quat(scalar_first=True)
    q[1:, 3:] *= np.cumprod(np.where((q[1:, 3:] * q[:-1, 3:]).sum(1) < 0, -1.0, 1.0))[:, None]
    motion = Motion("bench", body, Trajectory(np.arange(len(q)) / _RATE, q))
    return simulate(motion, profile=profile, seed=seed, suit=SUIT, options=SHORT)


def _leaning(turns: list[Rotation], degrees: float, seed: int) -> list[Rotation]:
    random = np.random.default_rng(seed)
    lean = np.deg2rad(degrees) * random.standard_normal((len(turns), 3))
    return [Rotation.from_rotvec(v) * t for v, t in zip(lean, turns, strict=True)]


@cache
def six_positions(
    directions: tuple[str, ...] = tuple(UP), *, hold: float = 2.0, lean: float = 3.0, seed: int = 0
) -> Recording:
    """The box is laid on its sides in turn, each leaning by some degrees."""
    keys = _leaning([UP[d] for d in directions], lean, seed + 100)
    marks = np.arange(2 * len(keys)) * 0.5 * hold
    path = Slerp(marks, Rotation.concatenate([k for key in keys for k in (key, key)]))
    # Held for `hold`, turned within half a second.
    knots = np.cumsum([0.0] + [hold, 0.5] * (len(keys) - 1) + [hold])
    at = np.interp(np.arange(int(knots[-1] * _RATE)) / _RATE, knots, marks)
    return _record(path(at), seed)


@cache
def turntable(
    directions: tuple[str, ...] = tuple(UP), *, rpm: float = 45.0, lean: float = 2.0, seed: int = 0
) -> Recording:
    """The box on a turntable, each side in turn: three seconds at speed, then still."""
    keys = _leaning([UP[d] for d in directions], lean, seed + 100)
    turns = []
    t = np.arange(int(4.5 * _RATE)) / _RATE
    speed = rpm * 2 * np.pi / 60 * np.clip(np.minimum(t / 0.4, (3.8 - t) / 0.4), 0, 1)
    angle = np.cumsum(speed) / _RATE
    for before, key in zip([keys[0], *keys[:-1]], keys, strict=True):
        spin = Rotation.from_rotvec(np.outer(angle, [0, 0, 1])) * key
        if before is not key:
            last = turns[-1][-1]
            path = Slerp([0, 1], Rotation.concatenate([last, key]))
            turns.append(path(np.linspace(0, 1, int(0.7 * _RATE))))
        turns.append(spin)
    return _record(Rotation.concatenate([r for part in turns for r in part]), seed)


def truth(recording: Recording, kind: str, board: str) -> tuple[np.ndarray, np.ndarray]:
    """Zero and slope that the simulator gave a board's sensor."""
    values = recording.truth.parameters
    return np.asarray(values[f"{kind}_bias/{board}"]), np.asarray(values[f"{kind}_scale/{board}"])


@cache
def left_alone(
    seconds: float = 70.0, *, white: float = 2.0, walk: float = 0.0, loss: float = 0.0
) -> Recording:
    """The box lies still; noise is `white` times the usual, the zeros wander by `walk` in 1 s."""
    profile = Profile(
        "still", NoiseFigures(accelerometer=0.02 * white, gyroscope=0.002 * white),
        gyroscope_bias=0.05, accelerometer_bias=0.3, gyroscope_drift=0.1 * walk,
        accelerometer_drift=walk, loss=loss, detector=False,
    )  # fmt: skip
    return _record(Rotation.concatenate([Rotation.identity()] * int(seconds * _RATE)), 5, profile)


BENCH = """<mujoco><worldbody><body name="bench" pos="0 0 1"><freejoint name="root"/>
<geom type="box" pos="0 0 -.1" size=".05 .05 .05" mass="1"/></body></worldbody></mujoco>"""


@cache
def measured_distances(
    offset: float = 0.01, seed: int = 3
) -> tuple[Recording, dict[tuple[str, str], float]]:
    """Sources and boards fixed in front of each other, and the true distances of all pairs [m]."""
    half = float(np.sqrt(0.5))
    boards = tuple(
        Mounting(f"board{i}", "bench", (0.3 + 0.15 * i, 0.1 * i - 0.2, 0.0), (half, 0, -half, 0))
        for i in range(5)
    )
    sources = tuple(
        Mounting(name, "bench", (0.0, y, 0.0), (half, 0.0, half, 0.0))
        for name, y in (("left", 0.1), ("right", -0.1))
    )
    profile = Profile("bench", NoiseFigures(), source_offset=offset, detector=False)
    body = load_body(BENCH)
    q = np.tile(np.asarray(body.qpos0), (200, 1))
    motion = Motion("bench", body, Trajectory(np.arange(200) / _RATE, q))
    recording = simulate(
        motion, profile=profile, seed=seed, suit=Suit(boards, sources), options=SHORT
    )
    apart = {
        (f"source/{s.name}", b.name): float(np.linalg.norm(np.subtract(s.position, b.position)))
        for s in sources
        for b in boards
    }
    return recording, apart

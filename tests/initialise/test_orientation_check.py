"""Orders of quaternions are told by gravity where nobody moves, and sound fast motion is sound."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.initialise.orientation_check import misread_orders, orientation_faults
from mocap_jax.initialise.reading_series import Series

STEP, UP = 0.04, np.array([0.0, 0.0, 9.81])
XYZW = "quaternions look like xyzw, read as wxyz"


def series(
    turn: Rotation, acceleration: np.ndarray, noise: float = 0.0, offset: float = 0.0, seed: int = 0
) -> Series:
    """Of a board that turns so at the edges of steps; its orientations err by white noise [rad]."""
    rng = np.random.default_rng(seed)
    step = (turn[:-1].inv() * turn[1:]).as_rotvec()
    force = (turn[:-1] * Rotation.from_rotvec(0.5 * step)).inv().apply(acceleration + UP)
    seen = turn * Rotation.from_rotvec(noise * rng.normal(size=(len(turn), 3)))
    return Series(STEP, force, step / STEP + offset, seen.as_quat(scalar_first=True))


def sway(seconds: float, size: float, seed: int = 0) -> Rotation:
    """A board mounted anyhow that turns slowly to and fro about all axes [rad]."""
    t = np.arange(int(seconds / STEP) + 1)[:, None] * STEP
    wave = size * np.sin(2 * np.pi * np.array([0.3, 0.41, 0.23]) * t + seed)
    return Rotation.from_rotvec(wave) * Rotation.random(random_state=seed)


def misread(s: Series) -> Series:
    """Its quaternions, written xyzw and read as wxyz."""
    return s._replace(orientation=np.roll(s.orientation, -1, axis=1))


QUIET = {f"board {i}": series(sway(2.0, 0.03, i), np.zeros(3), 0.02, 0.01, i) for i in range(6)}


def test_noise_of_orientations_contradicts_no_quiet_gyroscope() -> None:
    assert not any(orientation_faults(QUIET).values())
    assert not misread_orders(QUIET)


def test_a_wrong_order_is_named_in_quiet_motion() -> None:
    wrong = {name: misread(s) for name, s in QUIET.items()}
    assert misread_orders(wrong) == dict.fromkeys(QUIET, XYZW)
    assert orientation_faults(wrong) == {name: [XYZW] for name in QUIET}


def test_half_or_twice_gravity_in_the_median_is_no_fault() -> None:
    t = np.arange(150)[:, None] * STEP
    for up in (25.0, 9.0):  # limbs that swing at 2 Hz, and jumps
        shaken = up * np.sign(np.sin(4 * np.pi * t)) * [0.0, 0.3, 1.0]
        fast = series(sway(6.0, 1.0), shaken, 0.02)
        assert orientation_faults({"board": fast}) == {"board": []}


def test_steady_turning_is_no_contradiction() -> None:
    t = np.arange(76) * STEP
    turn = Rotation.from_euler("z", 2.5 * t[:, None]) * sway(3.0, 0.02)
    assert orientation_faults({"chest": series(turn, np.zeros(3), 0.02)}) == {"chest": []}


def test_rates_of_a_misread_file_accuse_no_gyroscope() -> None:
    boards = {f"board {i}": series(sway(8.0, 0.6, i), np.zeros(3), 0.01) for i in range(5)}
    # Nodding a little, upright: in the wrong order it nods the other way, gravity hardly off.
    t = np.arange(201) * STEP
    boards["level"] = series(Rotation.from_euler("y", 0.15 * np.sin(4 * t[:, None])), np.zeros(3))
    texts = orientation_faults({name: misread(s) for name, s in boards.items()})
    assert all(texts[f"board {i}"] == [XYZW] for i in range(5))
    assert texts["level"] == []


@pytest.mark.parametrize("factor", [np.pi / 180, -1.0])
def test_a_gyroscope_of_wrong_unit_or_sign_is_named(factor: float) -> None:
    board = series(sway(8.0, 0.6), np.zeros(3), 0.01)
    (text,) = orientation_faults({"board": board._replace(rate=factor * board.rate)})["board"]
    assert text.startswith("gyroscope")

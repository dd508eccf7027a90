"""How fast a measured root moves, whatever its noise and its stamps."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from cut_samples import recording

from mocap_jax.recording import RootStream, doubtful_root, root_speed


def straight(speed: float, time: np.ndarray, true_time: np.ndarray | None = None) -> RootStream:
    position = np.outer(speed * (time if true_time is None else true_time), [0.6, 0.8, 0.0])
    return RootStream(time, position, np.full((len(time), 4), np.nan))


TIME = np.arange(2000) / 200


def test_noise_and_bursts_of_stamps_are_no_speed() -> None:
    noise = 0.5 * np.random.default_rng(0).standard_normal((2000, 3))  # 200 m/s between samples
    noisy = straight(1.4, TIME)
    noisy = dataclasses.replace(noisy, position=noisy.position + noise)
    assert root_speed(noisy) < 4.0
    bursts = np.floor(TIME * 20) / 20 + 1e-6 * np.arange(2000)  # ten samples at once
    assert root_speed(straight(1.4, bursts, TIME)) == pytest.approx(1.4, rel=0.1)


def test_missing_positions_are_left_out() -> None:
    root = straight(1.4, TIME)
    root.position[::2] = np.nan
    assert root_speed(root) == pytest.approx(1.4)
    assert np.isnan(root_speed(dataclasses.replace(root, position=np.full((2000, 3), np.nan))))
    assert np.isnan(root_speed(straight(1.4, TIME[:100])))  # half a second tells nothing


def test_a_clock_that_jumps_by_years_takes_no_memory() -> None:
    assert root_speed(straight(1.0, np.array([0.0, 1.0, 1e9]))) == pytest.approx(1.0)


def test_who_is_faster_than_on_foot_is_told() -> None:
    told = lambda root: doubtful_root(dataclasses.replace(recording(), root=root))  # noqa: E731
    assert not told(None) and not told(straight(9.0, TIME)) and not told(straight(9.0, TIME[:9]))
    (sentence,) = told(straight(25.0, TIME))
    assert "25 m/s" in sentence and "millimetres" in sentence


def standing(height: float, measured: float = 1.0) -> RootStream:
    position = np.tile([0.3, 0.2, height], (2000, 1))
    return RootStream(TIME, position, np.full((2000, 4), 0.5 * measured))


def test_who_stands_hundreds_of_metres_high_is_told() -> None:
    told = lambda root: doubtful_root(dataclasses.replace(recording(), root=root))  # noqa: E731
    assert not told(standing(0.9)) and not told(standing(-20.0))
    assert not told(standing(905.0, np.nan))  # places alone: perhaps an altitude
    (sentence,) = told(standing(905.0))
    assert "905 m above" in sentence and "millimetres" in sentence
    (sentence,) = told(standing(90.5))
    assert "centimetres" in sentence
    fast = standing(905.0)
    fast.position[:, 0] = 30.0 * TIME
    (sentence,) = told(fast)  # one fault, one sentence
    assert "30 m/s" in sentence

"""Where frames are made, and pauses that no memory has room for."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.recording import InertialStream, Recording, RootStream, Setup, frame_extent

RATE = 100.0
HOUR = 3600.0


def stretch(start: float, count: int = 50) -> np.ndarray:
    return start + np.arange(count) / RATE


def board(*starts: float) -> InertialStream:
    time = np.concatenate([stretch(s) for s in starts])
    n = len(time)
    return InertialStream(time, np.zeros((n, 3)), np.zeros((n, 3)), np.full((n, 4), np.nan))


def recorded(*boards: InertialStream, root: np.ndarray | None = None) -> Recording:
    stream = None
    if root is not None:
        stream = RootStream(root, np.zeros((len(root), 3)), np.full((len(root), 4), np.nan))
    names = [f"board{i}" for i in range(len(boards))]
    return Recording(
        inertial=dict(zip(names, boards, strict=True)), ranges=None, root=stream, magnetic={},
        temperature=None, truth=None, setup=Setup(sensors=()), body_xml=None,
    )  # fmt: skip


def test_frames_reach_from_the_first_sample_to_the_last() -> None:
    extent = frame_extent(recorded(board(0.0), board(0.2)))
    assert (extent.start, extent.end) == pytest.approx((0.0, 0.69))
    assert extent.rate_hz == pytest.approx(RATE) and extent.frames == 70


@pytest.mark.parametrize(("pause", "sound"), [(180.0, True), (1900.0, True), (2100.0, False)])
def test_pauses_are_limited_by_their_empty_frames(pause: float, sound: bool) -> None:
    recording = recorded(board(0.0, pause))
    if sound:
        assert frame_extent(recording).frames == pytest.approx(RATE * pause + 50, abs=1)
    else:
        told = (
            r"for 2100 s, from 0.49 s to 2100.00 s: \d+ empty frames at 100 Hz \(at most 200000\)"
        )
        with pytest.raises(InputError, match=told):
            frame_extent(recording)
        assert frame_extent(recording, 10.0).rate_hz == 10.0  # of coarser frames there are few


def test_what_one_stream_measures_is_no_pause_of_another() -> None:
    first, second = board(0.0, 2 * HOUR), board(0.0, 0.5 * HOUR, HOUR, 1.5 * HOUR, 2 * HOUR)
    frame_extent(recorded(first, second))
    often, seldom = np.arange(0.0, 2 * HOUR), np.array([0.0, 2 * HOUR])
    frame_extent(recorded(first, root=often))
    with pytest.raises(InputError, match="for 7200 s"):
        frame_extent(recorded(first, root=seldom))


def test_streams_measure_in_turns() -> None:
    turns = [board(0.0, 0.5 * HOUR, HOUR), board(HOUR, 1.5 * HOUR, 2 * HOUR)]
    frame_extent(recorded(*turns))
    with pytest.raises(InputError, match="for 3600 s, from 3600.49 s to 7200.00 s"):
        frame_extent(recorded(turns[0], board(2 * HOUR)))


def test_what_lies_outside_of_the_frames_is_no_pause() -> None:
    root = np.array([-5 * HOUR, 0.1, 5 * HOUR])
    assert frame_extent(recorded(board(0.0), root=root)).frames == 50

"""Motions brought to the lowest of their frame rates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.errors import InputError
from mocap_jax.motion import Motion
from mocap_jax.simulation import frame_rate, same_rate
from mocap_jax.trajectory import Trajectory


@pytest.fixture
def sway(nodding_body):
    """A clip of three seconds: the root sways, the trunk turns round and round."""

    def clip(rate: float, jitter: float = 0.0) -> Motion:
        t = np.arange(round(3 * rate) + 1) / rate
        return Motion("sway", nodding_body, Trajectory(5.0 + t, poses(nodding_body, t, jitter)))

    return clip


def poses(body, t: np.ndarray, jitter: float = 0.0) -> np.ndarray:
    q = np.tile(np.asarray(body.qpos0), (len(t), 1))
    q[:, 0] = 0.1 * np.sin(5 * t) + jitter * np.sin(2 * np.pi * 41 * t)
    q[:, 7:11] = 0.0
    q[:, 7], q[:, 10] = np.cos(2 * t), np.sin(2 * t)
    return q


@pytest.mark.parametrize(("fast", "slow"), [(120.0, 60.0), (120.0, 50.0), (100.0, 59.94)])
def test_poses_are_those_of_the_same_times(nodding_body, sway, fast, slow):
    out = same_rate({"a": sway(fast), "b": sway(slow)})
    path = out["a"].trajectory
    t = np.asarray(path.time)
    assert frame_rate(out["a"]) == pytest.approx(slow, rel=1e-6)
    assert 3.0 - 1.01 / slow < t[-1] <= 3.001
    q, expected = np.array(path.q), poses(nodding_body, t)
    q[:, 7:11] *= np.sign((q[:, 7:11] * expected[:, 7:11]).sum(axis=1))[:, None]
    np.testing.assert_allclose(q, expected, atol=1e-4)
    assert out["a"].facts["resampled_from_hz"] == pytest.approx(fast)


def test_what_the_lower_rate_cannot_show_is_left_out(nodding_body, sway):
    """Jitter of 41 Hz would be one of 9 Hz in 50 frames a second."""
    path = same_rate({"a": sway(120.0, jitter=0.05), "b": sway(50.0)})["a"].trajectory
    t = np.asarray(path.time)
    inner = (t > 0.3) & (t < 2.7)
    error = np.asarray(path.q)[inner, 0] - 0.1 * np.sin(5 * t[inner])
    assert np.abs(error).max() < 0.002


def test_jumps_are_bridged_before_they_are_smeared(nodding_body, sway):
    """A tracking error of one rad for a twelfth of a second is none of the motion's."""
    clip = sway(120.0)
    q = np.array(clip.trajectory.q)
    broken = q.copy()
    broken[170:180, 7:11] = _turned(q[170:180, 7:11], 1.0)
    wrong = replace(clip, trajectory=Trajectory(clip.trajectory.time, broken))
    found = same_rate({"a": wrong, "b": sway(30.0)})["a"]
    t = np.asarray(found.trajectory.time)
    expected, got = poses(nodding_body, t)[:, 7:11], np.asarray(found.trajectory.q)[:, 7:11]
    off = 2 * np.arccos(np.abs((got * expected).sum(1)).clip(0, 1))
    assert off.max() < 0.1
    assert found.facts["bridged_frames"] > 10
    assert "bridged_frames" not in same_rate({"a": clip, "b": sway(30.0)})["a"].facts
    kept = same_rate({"a": wrong, "b": sway(30.0)}, fastest_joint=1e3)["a"]
    assert np.abs(np.asarray(kept.trajectory.q)[:, 7:11] - got).max() > 0.2


def _turned(q: np.ndarray, angle: float) -> np.ndarray:
    turn = Rotation.from_quat(q, scalar_first=True) * Rotation.from_rotvec([angle, 0.0, 0.0])
    return turn.as_quat(scalar_first=True)


def test_the_slowest_and_those_of_its_rate_stay_as_they_are(sway):
    given = {"a": sway(60.0), "b": sway(60.0 * (1 + 1e-6)), "c": sway(60.0)}
    out = same_rate(given)
    assert all(out[name] is given[name] for name in given)


def test_clips_too_short_for_it(sway):
    clip = sway(120.0)
    short = replace(clip, trajectory=Trajectory(np.arange(5) / 120, clip.trajectory.q[:5]))
    with pytest.raises(InputError, match="motion 'sway': 5 frames; at least 8 .* 120 to 60 Hz"):
        same_rate({"a": short, "b": sway(60.0)})

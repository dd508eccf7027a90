"""Positions from elsewhere: as the measured root without orientations, and as a residual."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from synthetic import record, small_body

import mocap_jax as mj
from mocap_jax.body import site_frames
from mocap_jax.errors import InputError
from mocap_jax.estimate import check_residual
from mocap_jax.estimate.free_roots import FreeRoot
from mocap_jax.estimate.sequence.pose_information import _nearest, references
from mocap_jax.measurement import gather
from mocap_jax.recording import RootStream, Setup
from mocap_jax.residuals.robust import loss

FRAMES = np.arange(6) / 10.0
MEASURED = (FreeRoot("pelvis", 0, 0, "measured"),)


def stream(time: np.ndarray, position: np.ndarray) -> RootStream:
    return RootStream(time, position, np.full((len(time), 4), np.nan))


def test_a_root_without_orientations_tells_positions_alone() -> None:
    body, setup = small_body(), Setup(sensors=())
    position = np.arange(18.0).reshape(6, 3)
    position[2] = np.nan
    data = SimpleNamespace(
        time=FRAMES, step=0.1, root_position=position, root_orientation=np.full((6, 4), np.nan)
    )
    reference, information = references(
        data, body, setup, mj.OptimiseOptions(), np.zeros(0, int), np.zeros(body.nv, bool),
        MEASURED,
    )  # fmt: skip
    known = np.array([0, 1, 3, 4, 5])
    np.testing.assert_array_equal(reference[0][known, :3], position[known])
    np.testing.assert_allclose(information[0][known, :3], 1 / setup.noise.root_position**2)
    assert not information[0][2, :3].any() and not information[0][:, 3:6].any()
    # What has no information still has to be a pose.
    np.testing.assert_allclose(reference[0][:, 3:7], np.tile(body.qpos0[3:7], (6, 1)))
    assert np.isfinite(reference).all()


def test_nothing_measured_is_said() -> None:
    body, nothing = small_body(), np.full((6, 4), np.nan)
    data = SimpleNamespace(
        time=FRAMES, step=0.1, root_position=nothing[:, :3], root_orientation=nothing
    )
    with pytest.raises(InputError, match="root 'given', but the recording has no root pose"):
        references(
            data, body, Setup(sensors=()), mj.OptimiseOptions(), np.zeros(0, int),
            np.zeros(body.nv, bool), MEASURED,
        )  # fmt: skip


def test_the_nearest_known_frame_stands_in() -> None:
    known = np.array([0, 1, 0, 0, 0, 1, 0], bool)
    np.testing.assert_array_equal(_nearest(known), [1, 1, 1, 1, 5, 5, 5])
    np.testing.assert_array_equal(_nearest(np.ones(3, bool)), [0, 1, 2])


def test_samples_between_frames() -> None:
    """Two in one interval, one at a frame, one missing, one before the recording."""
    body = small_body()
    at = np.arange(15.0).reshape(5, 3)
    at[3] = np.nan
    _, rows = mj.absolute_position(
        stream(np.array([-0.5, 0.12, 0.15, 0.3, 0.5]), at), FRAMES, body, sigma=2.0
    )
    assert rows["known"].shape == (6, 2) and rows["known"].sum() == 3
    np.testing.assert_allclose(rows["share"][1], [0.2, 0.5])
    np.testing.assert_array_equal(rows["position"][1], at[1:3])
    # The last frame has none after it: its sample is at the end of the interval before.
    np.testing.assert_allclose(rows["share"][4], [1.0, 0.0])


@pytest.mark.parametrize("site", [None, "forearm"])
def test_derivative_and_robust_size(site: str | None) -> None:
    body = small_body()
    rng = np.random.default_rng(0)
    q = np.tile(np.asarray(body.qpos0), (2, 1))
    q[1, :3] += 0.3
    residual, rows = mj.absolute_position(
        stream(np.array([0.02, 0.05]), rng.normal(size=(2, 3))), FRAMES, body,
        site=site, sigma=(0.5, 0.5, 1.0),
    )  # fmt: skip
    row = {k: v[0] for k, v in rows.items()}
    report = check_residual(residual, body, q, row)
    assert report.ok, str(report)
    place = [
        x[:3] if site is None else site_frames(body, jnp.asarray(x)).position[body.site_index(site)]
        for x in q
    ]
    share = row["share"][:, None]
    off = (1 - share) * np.asarray(place[0]) + share * np.asarray(place[1]) - row["position"]
    squared = ((off / [0.5, 0.5, 1.0]) ** 2).sum(1)
    got = np.asarray(residual.function(body, jnp.asarray(q), row))
    np.testing.assert_allclose((got**2).sum(), np.asarray(loss("cauchy", squared, 3.0)).sum())


def test_wrong_input() -> None:
    body, one = small_body(), stream(np.array([0.1]), np.zeros((1, 3)))
    with pytest.raises(InputError, match="site.*'chest'.*forearm"):
        mj.absolute_position(one, FRAMES, body, site="chest")
    with pytest.raises(InputError, match="sigma 0: must be above 0"):
        mj.absolute_position(one, FRAMES, body, sigma=0.0)
    with pytest.raises(InputError, match="no sample within the recording"):
        mj.absolute_position(one, FRAMES + 5, body)


def test_a_free_root_is_held_by_rough_positions_and_nonsense_among_them_is_not_believed() -> None:
    recording = record(seconds=10.0, rate_hz=60.0, root=False)
    recording = dataclasses.replace(recording, ranges=None)
    body, truth = small_body(), recording.truth.trajectory
    rng = np.random.default_rng(2)
    time = np.arange(0.25, 10.0, 0.5)
    near = np.clip(np.searchsorted(truth.time, time), 0, len(truth.time) - 1)
    at = np.asarray(truth.q)[near, :3] + 0.05 * rng.normal(size=(len(time), 3))
    at[9] += 30.0
    residual, rows = mj.absolute_position(
        stream(time, at), gather(recording, body).time, body, sigma=0.05
    )
    options = mj.OptimiseOptions(kinds="AG", root="free", covariance=False)

    def worst(options: mj.OptimiseOptions, data: tuple) -> float:
        solution = mj.optimise(recording, options=options, user_data=data)
        assert solution.status.ok
        off = np.asarray(solution.trajectory.q)[:, :3] - np.asarray(truth.q)[:, :3]
        return float(np.linalg.norm(off, axis=1).max())

    alone = worst(options, ())
    held = worst(dataclasses.replace(options, user_residuals=(residual,)), (rows,))
    assert held < 0.1 < 0.5 * alone, (held, alone)

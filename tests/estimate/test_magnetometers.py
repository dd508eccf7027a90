"""Kind M, magnetometers: they tell a free root's heading, in both estimators."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from joint_samples import sample
from scipy.spatial.transform import Rotation

import mocap_jax as mj
from mocap_jax.errors import InputError
from mocap_jax.estimate.magnetometers import north_at_rest
from mocap_jax.initialise import rest_pose
from mocap_jax.simulation import earth_field

NORTH = 0.7
# The declared pose faces elsewhere by so much.
TURN = Rotation.from_rotvec([0.0, 0.0, np.deg2rad(15.0)])
FIGURES = {"magnetic_north": NORTH, "magnetic_sigma": 0.1, "magnetic_time": 0.5}


@pytest.fixture(scope="module")
def recording() -> mj.Recording:
    level, _, down = earth_field(np.deg2rad(30.0))
    field = (level * np.cos(NORTH), level * np.sin(NORTH), down)
    return sample("ball", seed=1, seconds=8.0, magnetic_field=field).recording


def misfaced(recording: mj.Recording) -> mj.Recording:
    """The recording, its root declared to be turned about the vertical."""
    q = np.asarray(recording.truth.trajectory.q)[0]
    turned = (TURN * Rotation.from_quat(q[3:7], scalar_first=True)).as_quat(scalar_first=True)
    rest = recording.setup.rest
    pose = rest.pose | {"root": (*map(float, q[:3]), *map(float, turned))}
    setup = dataclasses.replace(recording.setup, rest=dataclasses.replace(rest, pose=pose))
    return dataclasses.replace(recording, setup=setup)


def heading_error(solution: mj.Solution, recording: mj.Recording) -> float:
    """Of the root in the last two seconds, root mean square [deg]."""
    truth = recording.truth.trajectory
    at = np.searchsorted(np.asarray(truth.time), np.asarray(solution.trajectory.time) - 1e-6)
    at = at.clip(0, len(truth.time) - 1)
    turns = [
        Rotation.from_quat(np.asarray(q)[:, 3:7], scalar_first=True)
        for q in (truth.q[at], solution.trajectory.q)
    ]
    error = (turns[1] * turns[0].inv()).as_rotvec()[-200:, 2]
    return float(np.rad2deg(np.sqrt((error**2).mean())))


def disturbed(recording: mj.Recording) -> mj.Recording:
    """For two seconds one board is near iron: its field is turned by about a right angle."""
    stream = recording.magnetic["shank"]
    field, time = np.array(stream.field), np.asarray(stream.time)
    near = (time > 5.0) & (time < 7.0)
    field[near] = np.roll(field[near], 1, axis=1) * 2.0
    changed = dataclasses.replace(stream, field=field)
    return dataclasses.replace(recording, magnetic=recording.magnetic | {"shank": changed})


def test_north_is_found_in_the_rest_pose(recording: mj.Recording) -> None:
    body = mj.load_body(recording.body_xml)
    found = north_at_rest(recording, body, rest_pose(recording, body, use_root=False))
    assert found == pytest.approx(NORTH, abs=0.05)


@pytest.mark.parametrize("iron", [False, True])
def test_the_filter_finds_its_heading(recording: mj.Recording, iron: bool) -> None:
    given = misfaced(disturbed(recording) if iron else recording)
    if not iron:
        plain = mj.ekf(given, options=mj.EkfOptions(kinds="AG", root="free"))
        assert heading_error(plain, recording) > 12.0
    options = mj.EkfOptions(kinds="AGM", root="free", magnetic_pull=1.0, **FIGURES)
    held = mj.ekf(given, options=options)
    assert heading_error(held, recording) < 4.0
    assert not any("Magnetometers left out" in text for text in held.remarks)
    assert held.statistics["magnetometer/thigh"]["count"] > 500


def test_the_optimiser_finds_its_heading(recording: mj.Recording) -> None:
    def run(kinds: str) -> mj.Solution:
        options = mj.OptimiseOptions(
            kinds=kinds, root="free", covariance=False, noise=mj.NoiseOptions(adapt=False),
            **FIGURES,
        )  # fmt: skip
        given = misfaced(disturbed(recording))
        strange = given.magnetic | {"iron": given.magnetic["shank"]}
        return mj.optimise(dataclasses.replace(given, magnetic=strange), options=options)

    assert heading_error(run("AG"), recording) > 12.0
    held = run("AGM")
    assert held.status.ok
    assert any("left out, of which there are no inertial readings: iron" in t for t in held.remarks)
    assert heading_error(held, recording) < 3.0


def test_residuals_of_the_user_s_own_stand_beside_it(recording: mj.Recording) -> None:
    """Without data of theirs, and on skin; a second one of the same name is refused."""
    body = mj.load_body(recording.body_xml)
    level = mj.UserResidual("level", lambda body, q, data: 1e-3 * q[0][2:3])
    options = mj.OptimiseOptions(
        kinds="AGM", root="free", covariance=False, initial="orientation",
        noise=mj.NoiseOptions(adapt=False), prior=mj.PriorOptions(skin_sigma=0.002),
        user_residuals=(level,), **FIGURES,
    )  # fmt: skip
    short = mj.cut(recording, 0.0, 4.0)
    found = mj.optimise(short, options=options)
    assert found.status.ok
    assert set(found.options["user_residuals"]) == {"level"}
    time = np.asarray(found.trajectory.time)
    twice, rows = mj.magnetic_heading(recording, body, time)
    options = dataclasses.replace(options, user_residuals=(twice,))
    with pytest.raises(InputError, match="user residual 'magnetometer': the name is taken"):
        mj.optimise(short, options=options, user_data=(rows,))


def test_wrong_input(recording: mj.Recording) -> None:
    blind = dataclasses.replace(recording, magnetic={})
    with pytest.raises(InputError, match="kind M: the recording has no magnetic streams"):
        mj.ekf(blind, options=mj.EkfOptions(kinds="AGM", root="free"))
    with pytest.raises(InputError, match="kind M: the recording has no magnetic streams"):
        mj.optimise(blind, options=mj.OptimiseOptions(kinds="AGM", root="free"))
    lost = dataclasses.replace(recording, magnetic={"iron": recording.magnetic["shank"]})
    with pytest.raises(InputError, match=r"only of iron, .*; valid kinds: A, G$"):
        mj.ekf(lost, options=mj.EkfOptions(kinds="AGM", root="free"))
    with pytest.raises(InputError, match="magnetic_sigma, magnetic_time, magnetic_pull"):
        mj.EkfOptions(magnetic_time=0.0)

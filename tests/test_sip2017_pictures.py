"""`scripts/reproduce_sip2017 --writing` and `--pictures`: motions and measures, no estimate."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from sip2017.foot_stamp import foot_stamp, thigh_angle
from sip2017.integration import integrated
from sip2017.letters import LETTERS, RATE, write
from sip2017.writing import laid_on
from sip2017.writing_motion import writing_motion

import mocap_jax as mj
from mocap_jax.simulation import Mounting, Suit


@pytest.mark.parametrize("letter", LETTERS)
def test_letters_are_drawn_smoothly(letter):
    path = write(letter, height=0.1)
    points = np.stack([path.across, path.up, path.off], axis=1)
    assert (path.off[path.down] == 0).all() and path.off.max() == pytest.approx(0.04, rel=0.01)
    assert path.off.min() >= 0 and not path.down[0] and not path.down[-1]
    speed = np.linalg.norm(np.diff(points, axis=0), axis=1) * RATE
    assert speed.max() < 1.0  # no jump between strokes
    assert np.abs(np.diff(points, 2, axis=0)).max() * RATE**2 < 40.0
    assert 0.05 < np.ptp(path.up[path.down]) < 0.2


def test_letters_stand_side_by_side():
    path = write("ma")
    first, second = path.stroke == 0, path.stroke == 1
    assert path.across[first].max() < path.across[second].min()


def test_the_wrist_writes_on_the_board():
    motion, path = writing_motion("c")
    model = motion.body.mujoco_model()
    data, places, q = mujoco.MjData(model), [], np.asarray(motion.trajectory.q)
    for pose in q:
        data.qpos = pose
        mujoco.mj_kinematics(model, data)
        places.append(data.body("RightHand").xpos.copy())
    wrist = np.array(places)[path.down]
    assert np.ptp(wrist[:, 0]) < 1e-3
    drawn = np.stack([-path.across, path.up], axis=1)[path.down]
    np.testing.assert_allclose(wrist[:, 1:] - wrist[0, 1:], drawn - drawn[0], atol=1e-3)
    elbow = q[:, model.joint("RightForeArm_flexion").qposadr[0]]
    low, high = model.joint("RightForeArm_flexion").range
    assert low < elbow.min() and elbow.max() < high


def test_paths_are_turned_about_the_vertical_and_shifted_only():
    rng = np.random.default_rng(0)
    true = rng.standard_normal((30, 3))
    turn = Rotation.from_euler("z", 130, degrees=True)
    np.testing.assert_allclose(laid_on(turn.apply(true) + [1, 2, 3], true), true, atol=1e-12)
    tilted = Rotation.from_euler("x", 20, degrees=True).apply(true)
    assert np.abs(laid_on(tilted, true) - true).max() > 0.1


def test_both_movements_tilt_the_shank_alike():
    motion = foot_stamp()
    model, q = motion.body.mujoco_model(), np.asarray(motion.trajectory.q)
    angle, data = thigh_angle(motion.body, q), mujoco.MjData(model)
    shank = []
    for time in (1.1, 3.0):
        at = int(np.argmin(np.abs(np.asarray(motion.trajectory.time) - time)))
        data.qpos = q[at]
        mujoco.mj_kinematics(model, data)
        shank.append(data.body("RightLowerLeg").xmat.copy())
        shank.append(angle[at])
    np.testing.assert_allclose(shank[0], shank[2], atol=1e-6)
    assert shank[1] == pytest.approx(60, abs=0.5) and abs(shank[3]) < 0.5


def test_integration_without_errors_finds_the_path():
    """A box that is pushed to and fro by a metre: the end is where it should be."""
    xml = """<mujoco><worldbody><body name="Pelvis"><freejoint/><geom size=".1"/></body>
    </worldbody></mujoco>"""
    body, time = mj.load_body(xml), np.arange(0, 3, 1 / 120)
    q = np.tile(np.asarray(body.qpos0), (len(time), 1))
    q[:, 0] = 0.5 * (1 - np.cos(2 * np.pi * time / 3))
    motion = mj.Motion("push", body, mj.Trajectory(time, q), {})
    recording = mj.simulate(
        motion, profile="ideal", suit=Suit((Mounting("back", "Pelvis", (0.1, 0.0, 0.0)),)),
        options=mj.SimulationOptions(orientations=True, inertial_rate_hz=60),
    )  # fmt: skip
    found_at, found = integrated(recording, "back")
    true = np.asarray(recording.truth.trajectory.q)[:, :3]
    moved = [np.interp(found_at, recording.truth.trajectory.time, c) for c in true.T]
    moved = np.stack(moved, axis=1) - true[0]
    np.testing.assert_allclose(found, moved, atol=0.02)
    board = recording.inertial["back"]
    biased = dataclasses.replace(board, accelerometer=board.accelerometer + [0.1, 0, 0])
    again = integrated(dataclasses.replace(recording, inertial={"back": biased}), "back")[1]
    np.testing.assert_allclose(again, found, atol=0.02)  # the rest hold takes it out

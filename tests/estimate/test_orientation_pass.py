"""Inverse kinematics of sensors: exact poses, OpenSim's cost, limits, hooks, missing data."""

from __future__ import annotations

import dataclasses
from xml.etree import ElementTree

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from mocap_jax.body import Coupling, load_body, site_frames
from mocap_jax.body.coupling import coupling_elements
from mocap_jax.body.piecewise import pieced
from mocap_jax.errors import InputError
from mocap_jax.estimate import OrientationPassOptions, orientation_pass
from mocap_jax.recording import InertialStream, Recording, RootStream, SensorSpec, Setup
from mocap_jax.solution import Status

XML = """<mujoco><compiler angle="radian" autolimits="true"/><worldbody>
<body name="trunk"><freejoint name="root"/><geom size="0.1"/>
<site name="trunk_s" quat="0.8 0.6 0 0"/>
<body name="upper" pos="0 0 -0.3"><joint name="a" axis="1 0 0"/><joint name="b" axis="0 1 0"
range="-0.5 0.5"/><geom size="0.1"/><site name="upper_s" quat="0 0.6 0 0.8"/>
<body name="lower" pos="0 0 -0.4"><joint name="c" type="ball"/><geom size="0.1"/>
<site name="lower_s"/></body></body></body></worldbody>{custom}</mujoco>"""
BODY = load_body(XML.format(custom=""))
FRAMES = 12


def poses(body, generator, frames: int = FRAMES) -> np.ndarray:
    """Smooth, within ranges."""
    s = np.linspace(0, 1, frames)
    q = np.tile(np.asarray(body.qpos0), (frames, 1))
    wave = lambda: np.sin(2 * np.pi * (s + generator.uniform())) * generator.uniform(0.2, 0.45)  # noqa: E731
    turn = np.stack([wave(), wave(), 2.0 + 2 * wave()], axis=1)
    q[:, 3:7] = Rotation.from_rotvec(turn).as_quat(scalar_first=True)
    q[:, 7], q[:, 8] = wave(), wave()
    q[:, 9:13] = Rotation.from_rotvec(np.stack([wave(), wave(), wave()], 1)).as_quat(
        scalar_first=True
    )
    return q


def recorded(body, q: np.ndarray, noise: float = 0.0, seed: int = 0) -> Recording:
    R = np.asarray(jax.vmap(lambda one: site_frames(body, one).rotation)(jnp.asarray(q)))
    generator = np.random.default_rng(seed)
    time, none = np.arange(len(q)) / 50, np.full((len(q), 3), np.nan)
    streams = {}
    for i, name in enumerate(body.topology.site_names):
        turn = Rotation.from_rotvec(noise * generator.normal(size=(len(q), 3)))
        quat = (Rotation.from_matrix(R[:, i]) * turn).as_quat(scalar_first=True)
        streams[name] = InertialStream(time, none, none, quat)
    sensors = tuple(SensorSpec(n, n, 50.0) for n in streams)
    return Recording(streams, None, None, {}, None, None, Setup(sensors=sensors), None)


def misfit(body, q: np.ndarray, recording: Recording, weights: dict[str, float]) -> float:
    """OpenSim's cost of one pose at the first frame, by SciPy."""
    R = np.asarray(site_frames(body, jnp.asarray(q)).rotation)
    total = 0.0
    for i, name in enumerate(body.topology.site_names):
        seen = Rotation.from_quat(recording.inertial[name].orientation[0], scalar_first=True)
        angle = (seen.inv() * Rotation.from_matrix(R[i])).magnitude()
        total += weights.get(name, 1.0) * angle**2
    return total


@pytest.mark.parametrize("warm", [False, True])
def test_exact_orientations_give_the_poses(warm: bool):
    q = poses(BODY, np.random.default_rng(1))
    options = OrientationPassOptions(warm_start=warm, seed_every=4)
    solution = orientation_pass(recorded(BODY, q), BODY, options=options)
    assert solution.status is Status.CONVERGED
    found = np.asarray(solution.trajectory.q)
    np.testing.assert_allclose(found[:, 7:9], q[:, 7:9], atol=1e-8)
    for at in (3, 9):
        turn = Rotation.from_quat(q[:, at : at + 4], scalar_first=True).inv() * Rotation.from_quat(
            found[:, at : at + 4], scalar_first=True
        )
        assert turn.magnitude().max() < 1e-7
    assert solution.observed == ("upper", "lower")
    assert solution.statistics["orientation/upper_s"]["rms_units"] < 1e-8


def test_each_frame_is_the_minimum_within_the_limits():
    weights = {"trunk_s": 3.0, "upper_s": 1.0, "lower_s": 0.5}
    q = poses(BODY, np.random.default_rng(2), 4)
    q[0, 8] = 0.9  # beyond the range: noise or a bad model would do the same
    recording = recorded(BODY, q, noise=0.1)
    solution = orientation_pass(recording, BODY, options=OrientationPassOptions(weights=weights))
    found = np.asarray(solution.trajectory.q)[0]
    assert found[8] == 0.5

    def pose(x: np.ndarray) -> np.ndarray:
        out = found.copy()
        for at, part in ((3, x[:3]), (9, x[5:])):
            turn = Rotation.from_quat(found[at : at + 4], scalar_first=True)
            out[at : at + 4] = (turn * Rotation.from_rotvec(part)).as_quat(scalar_first=True)
        out[7:9] = found[7:9] + x[3:5]
        return out

    bounds = [(-1, 1)] * 3 + [(-1, 1), (-0.5 - found[8], 0.5 - found[8])] + [(-1, 1)] * 3
    best = minimize(lambda x: misfit(BODY, pose(x), recording, weights), np.zeros(8),
                    bounds=bounds, method="L-BFGS-B", options={"ftol": 1e-15})  # fmt: skip
    assert np.abs(best.x).max() < 1e-4
    free = orientation_pass(
        recording, BODY, options=OrientationPassOptions(weights=weights, limits=False)
    )
    assert np.asarray(free.trajectory.q)[0, 8] > 0.6
    assert free.cost[0] < solution.cost[0]


def test_weight_of_zero_and_missing_samples_leave_a_sensor_out():
    q = poses(BODY, np.random.default_rng(3))
    recording = recorded(BODY, q)
    streams = dict(recording.inertial)
    wrong = np.roll(np.asarray(streams["lower_s"].orientation), 1, axis=1)
    gone = wrong.copy()
    gone[:] = np.nan
    for orientation, options in (
        (wrong, OrientationPassOptions(weights={"lower_s": 0.0})),
        (gone, OrientationPassOptions()),
    ):
        streams["lower_s"] = dataclasses.replace(streams["lower_s"], orientation=orientation)
        solution = orientation_pass(
            dataclasses.replace(recording, inertial=streams), BODY, options=options
        )
        found = np.asarray(solution.trajectory.q)
        np.testing.assert_allclose(found[:, 7:9], q[:, 7:9], atol=1e-8)
        # What nothing tells stays as at the start.
        np.testing.assert_allclose(found[:, 9:], np.tile([1, 0, 0, 0], (FRAMES, 1)), atol=1e-9)
        assert "orientation/lower_s" not in solution.statistics


def _upright(body, q):
    """A prior on one coordinate, of standard deviation 1/2."""
    return 2.0 * q[7:8]


def test_further_residuals_count():
    """With one hinge free, the prior pulls as in the closed form of two springs."""
    xml = """<mujoco><worldbody><body name="a"><freejoint/><geom size="0.1"/><site name="a_s"/>
    <body name="b"><joint name="h" axis="0 0 1"/><geom size="0.1"/><site name="b_s"/></body></body>
    </worldbody></mujoco>"""
    body = load_body(xml)
    q = np.tile(np.asarray(body.qpos0), (4, 1))
    q[:, 7] = 0.6
    recording = recorded(body, q)
    options = OrientationPassOptions(weights={"a_s": 1e6}, residuals=(_upright,))
    solution = orientation_pass(recording, body, options=options)
    assert np.asarray(solution.trajectory.q)[:, 7] == pytest.approx(0.6 / (1 + 4), abs=1e-5)


def test_coupled_coordinates_are_followed_exactly():
    curve = pieced(np.array([-1.0, 0.0, 1.0]), np.array([[0.3, -0.2, 0.1], [0.2, 0.0, 0.4]]))
    custom = ElementTree.Element("custom")
    custom.extend(coupling_elements(Coupling("b", "a", curve)))
    body = load_body(XML.format(custom=ElementTree.tostring(custom, encoding="unicode")))
    q = poses(BODY, np.random.default_rng(4))
    q[:, 8] = curve(q[:, 7])
    solution = orientation_pass(recorded(body, q), body)
    np.testing.assert_allclose(np.asarray(solution.trajectory.q)[:, 7:9], q[:, 7:9], atol=1e-7)
    noisy = orientation_pass(recorded(body, q, noise=0.05), body)
    found = np.asarray(noisy.trajectory.q)
    np.testing.assert_allclose(found[:, 8], curve(found[:, 7]), atol=1e-12)


def test_a_recorded_root_gives_the_position():
    q = poses(BODY, np.random.default_rng(5))
    recording = recorded(BODY, q)
    time = recording.inertial["trunk_s"].time
    where = np.stack([time, 2 * time, 1 + time], axis=1)
    root = RootStream(time, where, q[:, 3:7])
    solution = orientation_pass(dataclasses.replace(recording, root=root), BODY)
    np.testing.assert_allclose(np.asarray(solution.trajectory.q)[:, :3], where, atol=1e-12)


@pytest.mark.slow
def test_six_sensors_on_the_built_in_human():
    """Sparse suits leave joints open: sensors are met, and what nothing tells stays finite."""
    from mocap_jax.initialise import calibrate_to_pose
    from mocap_jax.motion import builtin_motion, human

    motion = builtin_motion("walking", human())
    q = np.asarray(motion.trajectory.q)[100:160:2]
    segments = ("Pelvis", "Head", "RightForeArm", "LeftForeArm", "RightLowerLeg", "LeftLowerLeg")
    rest = np.asarray(motion.body.qpos0)
    sites = ElementTree.fromstring(motion.body.xml)
    for element in list(sites.iter("body")):
        for site in element.findall("site"):
            element.remove(site)
        if element.get("name") in segments:
            ElementTree.SubElement(
                element, "site", name=element.get("name"), quat="0.5 0.5 0.5 0.5"
            )
    body = load_body(ElementTree.tostring(sites, encoding="unicode"))
    recording = recorded(body, np.concatenate([rest[None], q]))
    placed = calibrate_to_pose(recording, motion.body, {s: s for s in segments})
    solution = orientation_pass(placed.recording, placed.body)
    assert solution.status is Status.CONVERGED
    assert max(s["rms_units"] for s in solution.statistics.values()) < 1e-5
    along = orientation_pass(
        placed.recording, placed.body, options=OrientationPassOptions(warm_start=True)
    )
    assert along.cost[0] < 1e-8


def test_wrong_input_is_named():
    recording = recorded(BODY, poses(BODY, np.random.default_rng(6)))
    with pytest.raises(InputError, match="sensor 'hand_s'; valid:"):
        orientation_pass(recording, BODY, options=OrientationPassOptions(weights={"hand_s": 1.0}))
    with pytest.raises(InputError, match="'trunk_s' is -1"):
        orientation_pass(recording, BODY, options=OrientationPassOptions(weights={"trunk_s": -1}))
    with pytest.raises(InputError, match="start must be 13"):
        orientation_pass(recording, BODY, start=np.zeros(3))
    streams = {
        n: dataclasses.replace(s, orientation=np.full_like(s.orientation, np.nan))
        for n, s in recording.inertial.items()
    }
    with pytest.raises(InputError, match="no measured orientations"):
        orientation_pass(dataclasses.replace(recording, inertial=streams), BODY)


def test_steps_can_run_out():
    recording = recorded(BODY, poses(BODY, np.random.default_rng(7)))
    solution = orientation_pass(recording, BODY, options=OrientationPassOptions(iterations=1))
    assert solution.status is Status.MAX_ITERATIONS
    assert "frames reached the largest number of steps" in solution.remarks[0]

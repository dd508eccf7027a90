"""Scales, clocks, headings and walking biases of simulated boards, found with the motion."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap_jax.body import load_body
from mocap_jax.estimate import ConstantsOptions, NoiseOptions, OptimiseOptions, optimise
from mocap_jax.motion import Motion
from mocap_jax.recording import Recording
from mocap_jax.report.constant_truth import constant_truth
from mocap_jax.simulation import Mounting, SimulationOptions, Suit, simulate
from mocap_jax.simulation.profiles import PROFILES
from mocap_jax.solution import Solution, Status, determination
from mocap_jax.trajectory import Trajectory
from tests.small_arm import small_arm

ARM = small_arm("base", "upper", "lower", left=True)
SUIT = Suit(
    boards=(
        Mounting("base", "base", (0.0, -0.11, 0.1), (0.8, 0.6, 0.0, 0.0)),
        Mounting("upper", "upper", (0.15, 0.03, 0.05), (0.9, 0.1, -0.3, 0.3)),
        Mounting("lower", "lower", (0.2, 0.0, 0.04), (0.8, -0.2, 0.5, 0.1)),
    )
)
HEADING = {"base": 0.1, "upper": -0.25, "lower": 0.15}
ORIENTATION_NOISE = 0.02
TURNING = np.array([[0.0, 0.0, 0.0], [0.02, -0.015, 0.01], [-0.01, 0.0, 0.03]])
"""What is added to gyroscopes at three knots [rad/s]."""
OPTIONS = OptimiseOptions(
    kinds="AGO",
    noise=NoiseOptions(model_errors=False, adapt=False),
    constants=ConstantsOptions(
        accelerometer_scale_sigma=0.03, gyroscope_scale_sigma=0.03, clock_offset_sigma=0.01,
        heading_sigma=0.5, bias_interval=1e3, gyroscope_walk_sigma=0.02,
        accelerometer_walk_sigma=0.05, adapt=False,
    ),
)  # fmt: skip


def options(recording: Recording) -> OptimiseOptions:
    """Biases walk in two steps, however long the recording is."""
    start, end = recording.interval
    constants = dataclasses.replace(OPTIONS.constants, bias_interval=0.55 * (end - start))
    return dataclasses.replace(OPTIONS, constants=constants)


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Boards with wrong scales and clocks, gyroscopes that drift, compasses that are off."""
    profile = dataclasses.replace(
        PROFILES["paper"], name="self-calibration", detector=False, scale=0.01, clock_offset=0.004,
        gyroscope_bias=0.01, accelerometer_bias=0.1,
    )  # fmt: skip
    patch = pytest.MonkeyPatch()
    patch.setitem(PROFILES, profile.name, profile)
    made = simulate(
        _waves(), suit=SUIT, profile=profile.name, seed=3,
        options=SimulationOptions(rest_s=1.0, blend_s=0.5, inertial_rate_hz=70.0),
    )  # fmt: skip
    patch.undo()
    drift = _course(len(made.truth.trajectory.time))
    told, rng = dict(made.truth.parameters), np.random.default_rng(0)
    inertial = {}
    for name, board in made.inertial.items():
        told |= {f"gyroscope_drift/{name}": drift, f"heading/{name}": np.array(HEADING[name])}
        there = Rotation.from_rotvec([0, 0, HEADING[name]]) * _orientations(made, name)
        there = there * Rotation.from_rotvec(ORIENTATION_NOISE * rng.normal(size=(len(drift), 3)))
        inertial[name] = dataclasses.replace(
            board, gyroscope=np.asarray(board.gyroscope) + drift,
            orientation=there.as_quat(scalar_first=True),
        )  # fmt: skip
    setup = dataclasses.replace(
        made.setup, noise=dataclasses.replace(made.setup.noise, orientation=ORIENTATION_NOISE)
    )
    truth = dataclasses.replace(made.truth, parameters=told)
    return dataclasses.replace(made, inertial=inertial, truth=truth, setup=setup)


def _waves() -> Motion:
    """Four seconds with every coordinate in motion."""
    body, t = load_body(ARM), np.arange(0, 4, 1 / 120)
    wave = lambda size, hertz, phase: size * np.sin(2 * np.pi * hertz * t + phase)  # noqa: E731
    turn = lambda *sizes: Rotation.from_rotvec(  # noqa: E731
        np.stack([wave(a, 0.5 + 0.4 * i, i) for i, a in enumerate(sizes)], axis=1)
    ).as_quat(scalar_first=True)
    place = np.stack([wave(0.2, 0.5, 0), wave(0.1, 0.7, 0), 1.2 + wave(0.05, 1.6, 1)], axis=1)
    elbow = 1.0 + wave(0.9, 1.3, 0.5)
    q = np.concatenate([place, turn(0.4, 0.3, 0.9), turn(0.8, 0.5, 0.6), elbow[:, None]], axis=1)
    return Motion("waves", body, Trajectory(t, q))


def _course(frames: int) -> np.ndarray:
    place = np.linspace(0, 2, frames)
    return np.stack([np.interp(place, [0, 1, 2], x) for x in TURNING.T], axis=1)


def _orientations(recording: Recording, site: str) -> Rotation:
    """True orientations of a board, by C MuJoCo."""
    model = mujoco.MjModel.from_xml_string(recording.truth.body_xml)
    data, found = mujoco.MjData(model), []
    for q in np.asarray(recording.truth.trajectory.q):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        found.append(data.site(site).xmat.reshape(3, 3).copy())
    return Rotation.from_matrix(np.array(found))


def solve(recording: Recording) -> Solution:
    body = load_body(recording.body_xml)
    begin = Solution(recording.truth.trajectory, body, Status.SMOOTHED, "ekf", recording.setup)
    return optimise(recording, initial=begin, options=options(recording))


@pytest.fixture(scope="module")
def solved(recording: Recording) -> Solution:
    return solve(recording)


@pytest.mark.parametrize(
    ("kind", "sure", "stencil"),
    [
        ("accelerometer_scale", 1e-3, 2e-4), ("gyroscope_scale", 1e-3, 2e-4),
        ("clock_offset", 1e-4, 5e-5), ("heading", 0.005, 0.0), ("gyroscope_bias", 1e-3, 2e-4),
        ("gyroscope_bias_walk", 1e-3, 2e-4),
    ],
)  # fmt: skip
def test_errors_of_boards_are_found_within_their_deviation(
    recording: Recording, solved: Solution, kind: str, sure: float, stencil: float
) -> None:
    """To four deviations, and what differences of frames err by at 70 Hz."""
    truth = constant_truth(solved, recording)
    for name in recording.inertial:
        key = f"{kind}/{name}"
        deviation = np.asarray(solved.calibration_std[key])
        error = np.abs(np.asarray(solved.calibration[key]) - truth[key])
        assert deviation.min() < sure, (key, deviation)
        assert (error < 4 * deviation + stencil).all(), (key, error, deviation)


def test_what_moves_is_determined_and_what_stands_still_is_the_prior_s(
    recording: Recording, solved: Solution
) -> None:
    clocks = {f"clock_offset/{name}" for name in recording.inertial}
    assert not clocks & {name for name, _ in determination(solved).undetermined}
    held = solve(_until(recording, recording.setup.rest.end))
    unknown = {name for name, _ in determination(held).undetermined}
    assert clocks <= unknown and "gyroscope_scale/lower/x" in unknown
    assert not unknown & {f"heading/{name}" for name in recording.inertial}
    for name in recording.inertial:
        np.testing.assert_allclose(held.calibration_std[f"clock_offset/{name}"], 0.01, rtol=0.1)
    (told,) = [text for text in held.remarks if "Not determined" in text]
    assert "combinations of constants" in told


def _until(recording: Recording, end: float) -> Recording:
    """The recording up to a time."""

    def cut(stream):
        kept = np.asarray(stream.time) <= end
        return dataclasses.replace(
            stream, **{f.name: np.asarray(getattr(stream, f.name))[kept]
                       for f in dataclasses.fields(stream) if f.name != "name"}
        )  # fmt: skip

    return dataclasses.replace(
        recording, inertial={k: cut(s) for k, s in recording.inertial.items()},
        root=cut(recording.root), ranges=None,
        truth=dataclasses.replace(recording.truth, trajectory=_first(recording, end)),
    )  # fmt: skip


def _first(recording: Recording, end: float):
    trajectory = recording.truth.trajectory
    kept = np.asarray(trajectory.time) <= end
    return dataclasses.replace(
        trajectory, time=trajectory.time[kept], q=trajectory.q[kept], v=trajectory.v[kept]
    )

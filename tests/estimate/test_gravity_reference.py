"""Boards that do not accelerate tell which way is down, where accelerations are not used."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from joint_samples import POSITIONS, TURNS
from scipy.spatial.transform import Rotation
from synthetic import small_body

import mocap_jax as mj
from mocap_jax.body import load_body, retract, site_frames
from mocap_jax.errors import InputError
from mocap_jax.estimate.filter_tilt import tilt_update
from mocap_jax.estimate.gravity_reference import still_boards
from mocap_jax.estimate.sequence.terms import build
from mocap_jax.measurement import gather
from mocap_jax.measurement.chain import chain
from mocap_jax.measurement.predict import orientation
from mocap_jax.motion import Motion
from mocap_jax.residuals.gravity import tilt_error
from mocap_jax.simulation import Mounting, SimulationOptions, Suit, simulate

BODY = """<mujoco><worldbody><body name="thigh" pos="0 0 1"><freejoint name="root"/>
<geom size=".1"/><body name="shank" pos="0.02 0 -0.42"><joint name="joint" type="ball"/>
<geom size=".1"/></body></body></worldbody></mujoco>"""
RATE, MOVE, HOLD, MOVES = 50.0, 1.2, 0.8, 10


@pytest.fixture(scope="module")
def recording() -> mj.Recording:
    return holding(2)


def holding(seed: int) -> mj.Recording:
    """Two segments that go from one random pose to the next, and hold each: 20 s of `field`."""
    rng = np.random.default_rng(seed)
    poses = np.concatenate([np.zeros((1, 9)), rng.uniform(-0.8, 0.8, (MOVES, 9))])
    poses[:, :3] *= 0.4
    at = np.arange(0.0, MOVES * (MOVE + HOLD), 1 / RATE)
    number = (at / (MOVE + HOLD)).astype(int)
    x = np.clip((at - number * (MOVE + HOLD)) / MOVE, 0.0, 1.0)[:, None]
    delta = poses[number] + (x**3 * (10 - 15 * x + 6 * x**2)) * (poses[number + 1] - poses[number])
    quat = lambda v: Rotation.from_rotvec(v).as_quat(scalar_first=True)  # noqa: E731
    q = np.hstack([delta[:, :3] + [0, 0, 1], quat(delta[:, 3:6]), quat(delta[:, 6:])])
    motion = Motion("holds", load_body(BODY), mj.Trajectory(at, q))
    boards = tuple(
        Mounting(n, n, tuple(POSITIONS[n]), tuple(TURNS[n].as_quat(scalar_first=True)))
        for n in POSITIONS
    )
    made = simulate(
        motion, profile="field", seed=seed, suit=Suit(boards),
        options=SimulationOptions(rest_s=1.0, inertial_rate_hz=RATE),
    )  # fmt: skip
    return dataclasses.replace(made, root=None)


def tilt_errors(solution: mj.Solution, recording: mj.Recording) -> np.ndarray:
    """Of both segments in the last four seconds [deg]."""
    truth, time = recording.truth.trajectory, np.asarray(solution.trajectory.time)
    at = np.searchsorted(np.asarray(truth.time), time - 1e-6).clip(0, len(truth.time) - 1)
    ups = []
    for q in (np.asarray(truth.q)[at], np.asarray(solution.trajectory.q)):
        thigh, joint = (Rotation.from_quat(q[:, s], scalar_first=True)
                        for s in (slice(3, 7), slice(7, 11)))  # fmt: skip
        ups.append([r.inv().apply([0.0, 0.0, 1.0]) for r in (thigh, thigh * joint)])
    cosine = (np.array(ups[0]) * np.array(ups[1])).sum(-1).clip(-1, 1)
    return np.rad2deg(np.arccos(cosine))[:, time > time[-1] - 4.0]


def solve(recording: mj.Recording, gravity: mj.GravityOptions | None) -> mj.Solution:
    """From rates alone."""
    options = mj.OptimiseOptions(
        kinds="G", root="free", covariance=False, gravity=gravity,
        noise=mj.NoiseOptions(adapt=False), constants=mj.ConstantsOptions(adapt=False),
    )  # fmt: skip
    return mj.optimise(recording, options=options)


def test_tilt_does_not_drift(recording: mj.Recording) -> None:
    alone, held = solve(recording, None), solve(recording, mj.GravityOptions())
    assert held.status.ok
    drift, kept = (np.sqrt((tilt_errors(s, recording) ** 2).mean()) for s in (alone, held))
    assert kept < 0.6 * drift and kept < 2.5
    told = [r for r in held.remarks if r.startswith("Gravity reference")]
    assert len(told) == 1 and "thigh" in told[0] and "%" in told[0]
    assert not any("Gravity" in r for r in alone.remarks)


@pytest.mark.parametrize(
    ("method", "smooth"), [(mj.ekf, False), (mj.ekf, True), (mj.ukf, False)],
    ids=["ekf", "smoothed", "ukf"],
)  # fmt: skip
def test_tilt_of_the_filter_does_not_drift(
    recording: mj.Recording, method: Callable[..., mj.Solution], smooth: bool
) -> None:
    def run(gravity: mj.GravityOptions | None) -> mj.Solution:
        options = mj.EkfOptions(
            kinds="G", root="free", covariance=False, smooth=smooth, gravity=gravity
        )
        return method(recording, options=options)

    alone, held = run(None), run(mj.GravityOptions())
    drift, kept = (np.sqrt((tilt_errors(s, recording) ** 2).mean()) for s in (alone, held))
    assert kept < 0.6 * drift and kept < 3.5
    assert held.statistics["gravity/thigh"]["count"] > 100
    assert "gravity/thigh" not in alone.statistics


def test_derivative_of_the_filters_update() -> None:
    """Against the plain residual of the pose, by JAX; boards that may accelerate are off."""
    body, sites = small_body(), (0, 2, 3)
    rng = np.random.default_rng(0)
    step = lambda d: retract(body.topology, body.qpos0, d)  # noqa: E731
    q = step(jnp.asarray(0.5 * rng.normal(size=body.nv)))
    force, up = jnp.asarray(rng.normal(size=(3, 3)) + [0, 0, 9.8]), jnp.array([0.0, 0.0, 1.0])
    zero = jnp.zeros(body.nv)
    slope, residual, variance, active = tilt_update(
        orientation(body, chain(body, q, zero, zero), sites), force,
        jnp.array([True, False, True]), body.gravity, jnp.array([0.03, 25.0, 100.0, 3.0]),
        jnp.eye(body.nv),
    )  # fmt: skip

    def error(d: jax.Array) -> jax.Array:
        R = site_frames(body, retract(body.topology, q, d)).rotation[jnp.array(sites)]
        return tilt_error(R, force, up).reshape(-1)

    # In x and y of the world; about z nothing is told.
    level = np.tile([True, True, False], 3)
    there, off = np.repeat([True, False, True], 2), np.asarray(error(zero))[level]
    assert (error(zero)[~level] == 0).all()
    np.testing.assert_array_equal(active, there)
    np.testing.assert_allclose(residual[there], -off[there], atol=1e-12)
    expected = jax.jacfwd(error)(zero)[level]
    np.testing.assert_allclose(slope[there], expected[there], atol=1e-12)
    doubt = 1 + (off.reshape(3, 2) ** 2).sum(1) / 0.09**2
    expected = np.repeat(25 * 0.03**2 * doubt, 2)
    np.testing.assert_allclose(variance[there], expected[there], rtol=1e-9)


def test_moving_boards_take_no_share_of_the_filters_correction() -> None:
    """One still board of three is trusted as if it were alone; gravity is along no axis here."""
    body = small_body()
    rng = np.random.default_rng(3)
    q = retract(body.topology, body.qpos0, jnp.asarray(0.3 * rng.normal(size=body.nv)))
    force, zero = jnp.asarray(rng.normal(size=(3, 3)) + [0, 0, 9.8]), jnp.zeros(body.nv)

    def updated(sites: tuple[int, ...], active: list[bool]) -> list[np.ndarray]:
        out = tilt_update(
            orientation(body, chain(body, q, zero, zero), sites), force[: len(sites)],
            jnp.array(active), jnp.array([1.0, -3.0, -9.0]), jnp.array([10.0, 1e6, 5.0, 3.0]),
            1e-3 * jnp.eye(body.nv),
        )  # fmt: skip
        return [np.asarray(x)[:2] for x in out]

    alone = updated((0,), [True])
    for a, b in zip(updated((0, 2, 3), [True, False, False]), alone, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12)
    shared = updated((0, 2, 3), [True, False, True])
    np.testing.assert_allclose(shared[2], 2 * alone[2], rtol=1e-12)
    assert np.linalg.matrix_rank(alone[0]) == 2 and np.abs(alone[1]).min() > 0


def test_holds_are_found_and_moves_are_not(recording: mj.Recording) -> None:
    body = load_body(recording.body_xml)
    data = gather(recording, body, kinds="AG", root=False)
    still = still_boards(data, 9.81, mj.GravityOptions())
    phase = (np.asarray(data.time) - recording.setup.score_from) % (MOVE + HOLD)
    middle_of_move = (phase > 0.3 * MOVE) & (phase < 0.7 * MOVE)
    middle_of_hold = phase > MOVE + 0.3 * HOLD
    later = np.asarray(data.time) > recording.setup.score_from
    assert still[middle_of_hold & later].mean() > 0.7
    assert still[middle_of_move & later].mean() < 0.05


def test_short_and_incomplete_stretches_do_not_count(recording: mj.Recording) -> None:
    data = gather(recording, load_body(recording.body_xml), kinds="AG", root=False)
    force = np.tile([0.0, 0.0, 9.81], (*data.accelerometer.shape[:2], 1))
    rate = np.zeros_like(force)
    force[40:45, 0] *= 1.1  # a knock
    force[55:60, 0] = np.nan
    data = dataclasses.replace(data, accelerometer=force, gyroscope=rate)
    still = still_boards(data, 9.81, mj.GravityOptions(duration=0.25))
    expected = np.ones_like(still)
    expected[40:60, 0] = False  # the ten frames in between last for 0.2 s
    np.testing.assert_array_equal(still, expected)


def test_problems_are_built_with_it(recording: mj.Recording) -> None:
    body = load_body(recording.body_xml)
    options = mj.OptimiseOptions(kinds="AG", root="free", gravity=mj.GravityOptions())
    data = gather(recording, body, kinds="AG", root=False)
    built = build(data, body, recording.setup, options, root_given=False)
    assert built.layout.use_gravity and built.layout.gravity_loss == options.gravity.loss
    assert built.terms.gravity[1].any() and built.remarks[0].startswith("Gravity reference: boards")
    # Kinds that leave accelerometers out do not take the reference away.
    rates = gather(recording, body, kinds="G", root=False)
    with pytest.raises(InputError, match="no board of the recording has both"):
        build(rates, body, recording.setup, options, root_given=False)
    told = build(rates, body, recording.setup, options, root_given=False, inertial=data)
    np.testing.assert_array_equal(told.terms.gravity[1], built.terms.gravity[1])
    without = build(
        data, body, recording.setup, dataclasses.replace(options, gravity=None), root_given=False
    )
    assert not without.layout.use_gravity and not without.terms.gravity and not without.remarks


def test_wrong_input(recording: mj.Recording) -> None:
    with pytest.raises(InputError, match="gravity reference: sigma 0: must be above 0"):
        mj.GravityOptions(sigma=0.0)
    for name in ("duration", "pull", "scale"):
        with pytest.raises(InputError, match=f"gravity reference: {name} inf: .*finite"):
            mj.GravityOptions(**{name: np.inf})
    with pytest.raises(InputError, match="loss of the gravity reference 'square'; valid: none, hu"):
        mj.GravityOptions(loss="square")
    inertial = {
        k: dataclasses.replace(s, accelerometer=np.full_like(s.accelerometer, np.nan))
        for k, s in recording.inertial.items()
    }
    blind = dataclasses.replace(
        recording, inertial=inertial, setup=dataclasses.replace(recording.setup, rest=None)
    )
    body = load_body(recording.body_xml)
    with pytest.raises(InputError, match="no board of the recording has both"):
        still_boards(gather(blind, body, kinds="AG"), 9.81, mj.GravityOptions())

"""A small body in smooth motion and the exact readings of its sensors, for tests of estimators."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from mocap_jax import so3
from mocap_jax.body import Body, load_body, retract, site_frames, site_motion
from mocap_jax.recording import (
    InertialStream,
    NoiseFigures,
    RangeStream,
    Recording,
    RestHold,
    RootStream,
    SensorSpec,
    Setup,
    Truth,
)
from mocap_jax.trajectory import Trajectory

XML = """<mujoco><worldbody><body name="Pelvis" pos="0 0 1"><freejoint name="root"/>
<geom size=".1"/><site name="pelvis" pos=".1 .02 .03" quat=".8 .2 .3 .4"/>
<site name="source/belly" pos=".12 0 .1" quat=".7071068 0 .7071068 0"/>
<body name="UpperArm" pos="0 .2 .4"><joint name="shoulder" type="ball"/>
<geom size=".1"/><site name="upper_arm" pos=".03 .2 0" quat=".5 .2 .3 -.4"/>
<body name="ForeArm" pos="0 .3 0"><joint name="elbow" axis="0 0 1"/>
<joint name="twist" axis="0 1 0"/>
<geom size=".1"/><site name="forearm" pos="0 .2 .02" quat=".3 .2 .7 -.4"/></body></body>
</body></worldbody></mujoco>"""
SENSORS = ("pelvis", "upper_arm", "forearm")


def small_body() -> Body:
    return load_body(XML)


def record(
    *,
    seconds: float = 6.0,
    rate_hz: float = 140.0,
    noise: float = 1.0,
    seed: int = 0,
    root: bool = True,
) -> Recording:
    """One second of rest, then sines on every degree of freedom, starting smoothly."""
    body = small_body()
    rng = np.random.default_rng(seed)
    amplitude = rng.uniform(0.2, 0.5, body.nv) * np.where(np.arange(body.nv) < 3, 0.2, 1)
    frequency = rng.uniform(0.5, 1.5, body.nv)
    n = int(seconds * rate_hz)
    time = np.arange(n) / rate_hz

    def pose(t: jax.Array) -> jax.Array:
        s = jnp.clip((t - 1.0) / 1.5, 0, 1)
        blend = s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)
        delta = blend * amplitude * jnp.sin(2 * jnp.pi * frequency * (t - 1.0))
        return retract(body.topology, body.qpos0, jnp.asarray(delta))

    q, v, a = _derivatives(body, pose, time)
    motion = jax.jit(jax.vmap(lambda q, v, a: site_motion(body, q, v, a)))(q, v, a)
    figures = NoiseFigures()
    R_sensor_world = jnp.swapaxes(motion.rotation, -1, -2)
    force = so3.matvec3(R_sensor_world, motion.acceleration - body.gravity)
    rate = so3.matvec3(R_sensor_world, motion.angular_velocity)
    noisy = lambda x, sigma: np.asarray(x) + noise * sigma * rng.normal(size=x.shape)  # noqa: E731
    inertial = {}
    for name in SENSORS:
        s = body.site_index(name)
        inertial[name] = InertialStream(
            time, noisy(force[:, s], figures.accelerometer),
            noisy(rate[:, s], figures.gyroscope), np.full((n, 4), np.nan),
        )  # fmt: skip
    turn = so3.quat_exp(jnp.asarray(noise * figures.root_orientation * rng.normal(size=(n, 3))))
    measured_root = RootStream(
        time, noisy(q[:, :3], figures.root_position), np.asarray(so3.quat_multiply(q[:, 3:7], turn))
    )
    setup = Setup(
        sensors=tuple(SensorSpec(s, s, rate_hz) for s in SENSORS),
        sources=("source/belly",),
        noise=figures,
        rest=RestHold(0.0, 1.0, {}),
    )
    return Recording(
        inertial, _ranges(body, pose, time, noise, rng, figures), measured_root if root else None,
        {}, None, Truth(Trajectory(time, np.asarray(q), np.asarray(v)), XML), setup, XML,
    )  # fmt: skip


def _derivatives(body: Body, pose, time: np.ndarray) -> tuple:
    """Pose, velocity and acceleration in the tangent space, by differentiating the pose."""
    from mocap_jax.body.tangent import velocity_to_tangent

    def velocity(t: jax.Array) -> jax.Array:
        q, dq = jax.jvp(pose, (t,), (jnp.ones_like(t),))
        return velocity_to_tangent(body.topology, q, dq)

    def both(t: jax.Array) -> tuple:
        v, a = jax.jvp(velocity, (t,), (jnp.ones_like(t),))
        return pose(t), v, a

    return jax.jit(jax.vmap(both))(jnp.asarray(time))


def _ranges(body, pose, time, noise, rng, figures) -> RangeStream:
    """Every 8 ms from the belly to all boards; arrival by fixed-point iteration."""
    emission = np.arange(time[0] + 0.001, time[-1], 0.008)
    at = jax.jit(jax.vmap(lambda t: site_frames(body, pose(t)).position))
    sites = np.array([body.site_index(s) for s in SENSORS])
    source = np.asarray(at(jnp.asarray(emission)))[:, body.site_index("source/belly")]
    distance = np.zeros((len(emission), len(SENSORS)))
    for i, site in enumerate(sites):
        for _ in range(4):
            arrival = np.asarray(at(jnp.asarray(emission + distance[:, i] / 343.0)))[:, site]
            distance[:, i] = np.linalg.norm(arrival - source, axis=1)
    distance += noise * figures.range * rng.normal(size=distance.shape)
    n, k = distance.shape
    return RangeStream(
        np.repeat(emission, k), np.zeros(n * k, int), np.tile(np.arange(k), n),
        distance.reshape(-1), np.ones(n * k), ("source/belly",), SENSORS,
    )  # fmt: skip

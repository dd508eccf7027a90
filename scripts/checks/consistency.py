"""Motion drawn from the optimiser's own process prior: its covariance must then be right.

Frames follow third differences of white noise in the tangent space, exactly the prior of order 3;
a quintic spline joins them. Boards are C MuJoCo's sensors averaged over each sample interval, as
in the simulator, so nothing of the estimator's measurement code is used. Everything else is drawn
from its declared distribution too: rest pose, biases, mounting rotations and offsets, white noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from mocap_jax import so3
from mocap_jax.body import Body, difference, load_body, retract, site_frames
from mocap_jax.estimate import OptimiseOptions, optimise
from mocap_jax.estimate.whole_sequence_options import ConstantsOptions, NoiseOptions, PriorOptions
from mocap_jax.least_squares import SolverOptions
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
from mocap_jax.simulation.rig import build_rig, inertial_readings
from mocap_jax.simulation.spline import PoseSpline
from mocap_jax.solution import Solution, Status
from mocap_jax.solution.propagate import velocity_std
from mocap_jax.trajectory import Trajectory

XML = """<mujoco><worldbody><body name="Pelvis" pos="0 0 1"><freejoint name="root"/>
<geom size=".1"/><site name="pelvis" pos=".1 .02 .03" quat=".8 .2 .4 .4"/>
<site name="source/belly" pos=".12 0 .1" quat=".7071068 0 .7071068 0"/>
<body name="UpperArm" pos=".1 .2 .4"><joint name="shoulder" type="ball"/>
<geom size=".1"/><site name="upper_arm" pos=".23 .1 0" quat=".5 .5 .5 -.5"/>
<body name="ForeArm" pos=".3 0 0"><joint name="elbow" axis="0 0 1"/>
<geom size=".1"/><site name="forearm" pos=".2 0 .02" quat=".8 .2 -.4 .4"/></body></body>
</body></worldbody></mujoco>"""
SENSORS = ("pelvis", "upper_arm", "forearm")
RATE_HZ = 140.0
FIGURES = NoiseFigures()
JERK = np.repeat([1.0, 4.0, 4.0], [3, 3, 4])
"""Jerk density of the root's translation and of all rotations [m^2/s^5, rad^2/s^5]."""
REST_SIGMA = 0.05
CONSTANTS = ConstantsOptions(
    gyroscope_bias_sigma=0.01, accelerometer_bias_sigma=0.05, mounting_sigma=0.02,
    offset_sigma=0.005, adapt=False,
)  # fmt: skip
# Frames drawn before the first and after the last, so that no sample feels the spline's ends.
_MARGIN = 6
_NODES = 4


@dataclass(frozen=True)
class Errors:
    """What one run shows."""

    nees: np.ndarray
    """(t,) squared pose errors in units of the claimed covariance, per degree of freedom."""
    constants: float
    """Mean squared error of the sensors' constants in units of their claimed deviations."""
    velocity: float
    """Mean squared error of finite differences of poses in units of their claimed deviations."""
    status: Status


def options(kinds: str) -> OptimiseOptions:
    """Declared noise and priors only: nothing adapted, nothing robust, no model errors."""
    return OptimiseOptions(
        kinds=kinds,
        root="given",
        constants=CONSTANTS,
        noise=NoiseOptions(
            model_errors=False, adapt=False, lever_arm_sigma=0.0, inertial_loss="none",
            range_loss="none",
        ),
        prior=PriorOptions(
            smoothness_order=3, smoothness_density=float(JERK[-1]),
            shared_smoothness_density=float(JERK[-1]),
            translation_density=float(JERK[0]), rest_sigma=REST_SIGMA, pose_sigma=1e4,
            limits=False,
        ),
        solver=SolverOptions(tolerance=1e-3, initial_damping=1e-6),
        pair_covariance=True,
    )  # fmt: skip


def run(seed: int, *, kinds: str = "AGD", seconds: float = 1.5) -> Errors:
    """Draw, measure and estimate one motion."""
    body, rng = load_body(XML), np.random.default_rng(seed)
    recording, constants = draw(body, rng, seconds, kinds)
    solution = optimise(
        recording, body, initial=_start(recording, body, rng), options=options(kinds)
    )
    truth = recording.truth.trajectory.q
    error = np.asarray(_differences(body, np.asarray(solution.trajectory.q), truth))
    P = np.asarray(solution.covariance)
    nees = np.einsum("ti,ti->t", error, np.linalg.solve(P, error[..., None])[..., 0]) / body.nv
    found, deviation = solution.calibration, solution.calibration_std
    off = [(np.asarray(found[k]) - constants[k]) / np.asarray(deviation[k]) for k in constants]
    speed = [
        np.asarray(_differences(body, np.asarray(q[:-1]), np.asarray(q[1:]))) * RATE_HZ
        for q in (solution.trajectory.q, truth)
    ]
    blur = (speed[0] - speed[1]) / velocity_std(solution)
    return Errors(
        nees, float(np.mean(np.square(off))), float(np.mean(blur**2)), solution.status
    )  # fmt: skip


@jax.jit
def _differences(body: Body, q: jax.Array, to: jax.Array) -> jax.Array:
    return jax.vmap(lambda a, b: difference(body.topology, a, b))(q, to)


def _start(recording: Recording, body: Body, rng: np.random.Generator) -> Solution:
    """Somewhere near: the truth turned by a constant in every coordinate."""
    truth = recording.truth.trajectory
    aside = 0.03 * rng.normal(size=body.nv)
    q = jax.vmap(lambda a: retract(body.topology, a, aside))(jnp.asarray(truth.q))
    trajectory = Trajectory(truth.time, np.asarray(q), np.asarray(truth.v))
    return Solution(trajectory, body, Status.CONVERGED, "draw", recording.setup)


def draw(
    body: Body, rng: np.random.Generator, seconds: float, kinds: str
) -> tuple[Recording, dict[str, np.ndarray]]:
    """A recording and the sensors' true constants."""
    frames = round(seconds * RATE_HZ)
    time = np.arange(-_MARGIN, frames + _MARGIN) / RATE_HZ
    spline = PoseSpline(body.topology, time, draw_motion(body, rng, frames))
    inside = time[_MARGIN : _MARGIN + frames]
    q, v, _ = spline.evaluate(inside)
    constants = _draw_constants(rng)
    inertial = _boards(body, spline, inside, constants, rng)
    turn = so3.quat_exp(jnp.asarray(FIGURES.root_orientation * rng.normal(size=(frames, 3))))
    root = RootStream(
        inside, q[:, :3] + FIGURES.root_position * rng.normal(size=(frames, 3)),
        np.asarray(so3.quat_multiply(jnp.asarray(q[:, 3:7]), turn)),
    )  # fmt: skip
    setup = Setup(
        sensors=tuple(SensorSpec(s, s, RATE_HZ) for s in SENSORS),
        sources=("source/belly",), noise=FIGURES, rest=RestHold(0.0, 0.0, {}),
    )  # fmt: skip
    ranges = _ranges(body, spline, inside, constants, rng) if "D" in kinds else None
    truth = Truth(Trajectory(inside, q, v), XML)
    return Recording(inertial, ranges, root, {}, None, truth, setup, XML), constants


def draw_motion(body: Body, rng: np.random.Generator, frames: int) -> np.ndarray:
    """Poses (frames + 2 margins, nq): the pose at time zero is near the declared one.

    Increments u of the pose obey u_k+1 - 2 u_k + u_k-1 = h^3 w, w of variance S / h. The margin
    before time zero is the same process run backwards, which has the same law.
    """
    h, nv = 1 / RATE_HZ, body.nv
    sigma = h**3 * np.sqrt(JERK / h)
    total = frames + 2 * _MARGIN
    zero = _MARGIN
    u = np.zeros((total, nv))
    u[zero] = h * 0.3 * rng.normal(size=nv)
    u[zero + 1] = u[zero] + h**2 * 0.5 * rng.normal(size=nv)
    for k in range(zero + 2, total):
        u[k] = 2 * u[k - 1] - u[k - 2] + sigma * rng.normal(size=nv)
    for k in range(zero - 1, -1, -1):
        u[k] = 2 * u[k + 1] - u[k + 2] + sigma * rng.normal(size=nv)
    spread = REST_SIGMA * rng.normal(size=nv)
    first = retract(body.topology, body.qpos0, jnp.asarray(spread))
    move = jax.jit(lambda q, d: retract(body.topology, q, d))
    q = np.zeros((total, body.nq))
    q[zero] = first
    for k in range(zero, total - 1):
        q[k + 1] = move(q[k], u[k])
    for k in range(zero, 0, -1):
        q[k - 1] = move(q[k], -u[k - 1])
    return q


def _draw_constants(rng: np.random.Generator) -> dict[str, np.ndarray]:
    c = CONSTANTS
    sigmas = {
        "gyroscope_bias": c.gyroscope_bias_sigma,
        "accelerometer_bias": c.accelerometer_bias_sigma,
        "mounting_rotation": c.mounting_sigma,
        "mounting_offset": c.offset_sigma,
    }
    return {
        f"{key}/{name}": sigma * rng.normal(size=3)
        for name in SENSORS
        for key, sigma in sigmas.items()
    }


def _boards(
    body: Body, spline: PoseSpline, time: np.ndarray, constants: dict[str, np.ndarray],
    rng: np.random.Generator,
) -> dict[str, InertialStream]:  # fmt: skip
    """Means of C MuJoCo's readings over each sample interval, with bias and white noise."""
    true = load_body(_worn(body, constants))
    rig = build_rig(true, SENSORS, ())
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    at = (time[:, None] + 0.5 / RATE_HZ * nodes).ravel()
    readings = inertial_readings(rig, spline, at).reshape(len(time), _NODES, len(SENSORS), 6)
    mean = np.einsum("k,tksi->tsi", 0.5 * weights, readings)
    out = {}
    for i, name in enumerate(SENSORS):
        noise = rng.normal(size=(len(time), 6))
        out[name] = InertialStream(
            time,
            mean[:, i, :3] + constants[f"accelerometer_bias/{name}"]
            + FIGURES.accelerometer * noise[:, :3],
            mean[:, i, 3:] + constants[f"gyroscope_bias/{name}"]
            + FIGURES.gyroscope * noise[:, 3:],
            np.full((len(time), 4), np.nan),
        )  # fmt: skip
    return out


def _worn(body: Body, constants: dict[str, np.ndarray]) -> str:
    """The body with its boards as they are really mounted."""
    import mujoco

    spec = mujoco.MjSpec.from_string(body.xml)
    for name in SENSORS:
        site = spec.site(name)
        quat = np.array(site.quat) / np.linalg.norm(site.quat)
        R = np.asarray(so3.quat_to_matrix(jnp.asarray(quat)))
        site.pos = np.array(site.pos) + R @ constants[f"mounting_offset/{name}"]
        turn = so3.quat_exp(jnp.asarray(constants[f"mounting_rotation/{name}"]))
        site.quat = np.asarray(so3.quat_multiply(jnp.asarray(quat), turn))
    spec.compile()
    return spec.to_xml()


def _ranges(
    body: Body, spline: PoseSpline, time: np.ndarray, constants: dict[str, np.ndarray],
    rng: np.random.Generator,
) -> RangeStream:  # fmt: skip
    """From the belly to all boards every 8 ms; the arrival by fixed-point iteration."""
    true = load_body(_worn(body, constants))
    emission = np.arange(0.001, time[-1] - 0.005, 0.008)
    at = lambda t: np.asarray(_positions(true, spline.pose(t)))  # noqa: E731
    source = at(emission)[:, true.site_index("source/belly")]
    sites = [true.site_index(s) for s in SENSORS[1:]]
    distance = np.zeros((len(emission), len(sites)))
    for i, site in enumerate(sites):
        for _ in range(3):
            ear = at(emission + distance[:, i] / 343.0)[:, site]
            distance[:, i] = np.linalg.norm(ear - source, axis=1)
    n, k = distance.shape
    noisy = distance + FIGURES.range * rng.normal(size=(n, k))
    return RangeStream(
        np.repeat(emission, k), np.zeros(n * k, int), np.tile(np.arange(k), n), noisy.ravel(),
        np.ones(n * k), ("source/belly",), SENSORS[1:],
    )  # fmt: skip


@jax.jit
def _positions(body: Body, q: jax.Array) -> jax.Array:
    return jax.vmap(lambda x: site_frames(body, x)[1])(q)

"""A free body with one board and no measured root: the worst conditioned problem there is.

Position follows from accelerations integrated twice, so rounding in J'J grows with the fourth
power of the number of frames. The reference step comes from a QR factorisation of J itself, frame
by frame in extended precision, with a Jacobian by JAX from the plain residual functions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from mocap_jax import linalg
from mocap_jax.body import Body, difference, load_body, retract, site_frames, site_motion
from mocap_jax.body.tangent import velocity_to_tangent
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.layout import Layout, Terms, Weights
from mocap_jax.estimate.sequence.model_gradient import model_gradient, moved_constants
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.least_squares.step import NEARLY, REFINED
from mocap_jax.linalg.refine import refine, shifted_factor
from mocap_jax.residuals.inertial import (
    CONSISTENT,
    acceleration_residual,
    mean_rate,
    rate_residual,
)

XML = """<mujoco><worldbody><body name="Pelvis" pos="0 0 1"><freejoint name="root"/>
<geom size=".1"/><site name="board" pos=".1 .05 .02" quat=".8 .2 .4 .4"/></body></worldbody>
</mujoco>"""
RATE_HZ = 140.0
REST_SECONDS = 1.0
FORCE_SIGMA, RATE_SIGMA, REST_SIGMA = 0.02, 0.002, 0.005
# White acceleration of the root [m^2/s^3], [rad^2/s^3].
DENSITY = np.repeat([20.0, 60.0], 3)
CONSTANT_SIGMA = np.repeat([0.01, 0.1, 0.05, 0.005], 3)


@dataclass(frozen=True)
class FreeRoot:
    """The problem, where it is linearised, and its plain measurements."""

    body: Body
    problem: SequenceProblem
    state: State
    terms: Terms


@dataclass(frozen=True)
class StepErrors:
    """Errors of the linear step relative to the reference (largest entry over largest entry)."""

    frames: int
    border: bool
    shift: float
    """What had to be added to the diagonal for a Cholesky factorisation; 0 if nothing."""
    cholesky: float
    """Plain solve with the assembled normal equations, shifted so."""
    refined: float
    """The same after refinement."""
    position: float
    """Largest error of a position after refinement [m]."""
    steps: tuple[float, ...]
    """Relative sizes of the refinement's steps."""


def measure(frames: int, *, border: bool) -> StepErrors:
    """Compare the linear step of a sequence with the reference."""
    case = make(frames, border=border)
    x_true, z_true = reference_step(case, border=border)
    equations = case.problem.linearise(case.state)
    scale = max(np.abs(x_true).max(), np.abs(z_true).max(initial=0.0))

    def error(x: np.ndarray, z: np.ndarray) -> float:
        return max(np.abs(x - x_true).max(), np.abs(z - z_true).max(initial=0.0)) / scale

    f, shift = shifted_factor(equations.lower, equations.corner, equations.border)
    x, z = linalg.solve(f, -equations.gradient, -equations.corner_gradient, equations.border)
    refined = refine(
        f, equations.border, partial(_model, case), x, z, tolerance=REFINED, nearly=NEARLY
    )
    off = float(np.abs(refined.x - x_true)[:, :3].max())
    return StepErrors(
        frames, border, shift, error(x, z), error(refined.x, refined.z), off, refined.steps
    )


def _model(
    case: FreeRoot, x: np.ndarray, z: np.ndarray, *, offset: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Products with J, for the refinement."""
    problem = case.problem
    chunks = problem._inputs(case.state)
    slope, slope_z = model_gradient(problem.layout, chunks, problem.weights, x, z, offset=offset)
    if problem.layout.use_border:
        _, prior, square = problem._prior(case.state.constants)
        slope_z = slope_z + square @ z + offset * prior
    return slope, slope_z


def make(frames: int, *, border: bool, seed: int = 0) -> FreeRoot:
    """Sines on all six degrees of freedom after a rest, linearised beside the truth."""
    body, rng = load_body(XML), np.random.default_rng(seed)
    time = np.arange(frames) / RATE_HZ
    q, force, rate = _truth(body, time, rng)
    force = force + FORCE_SIGMA * rng.normal(size=force.shape)
    rate = rate + RATE_SIGMA * rng.normal(size=rate.shape)
    mean = mean_rate(rate)
    inside = ((np.arange(frames) > 0) & (np.arange(frames) < frames - 1)).astype(float)
    information = np.zeros((2, frames, 6))
    information[0, time < REST_SECONDS] = REST_SIGMA**-2
    none, one = np.zeros((frames, 1)), np.ones((frames, 1))
    terms = Terms(
        force=force[:, None], force_information=inside[:, None] / FORCE_SIGMA**2,
        rate=rate[:, None], mean_rate=np.nan_to_num(mean)[:, None],
        rate_information=np.isfinite(mean).all(1)[:, None] / RATE_SIGMA**2,
        orientation=np.tile(np.eye(3), (frames, 1, 1, 1)), orientation_information=none,
        range_distance=none, range_information=none, range_source=none.astype(int),
        range_receiver=none.astype(int), range_lead=none, range_flight=none,
        reference=np.tile(np.asarray(body.qpos0), (2, frames, 1)),
        reference_information=information,
        smoothness_information=inside[:, None] / RATE_HZ / DENSITY * one,
        limit_information=np.zeros(frames), pose_information=np.zeros(frames),
        pace_information=np.zeros(frames),
    )  # fmt: skip
    layout = Layout(
        topology=body.topology, sites=(body.site_index("board"),), range_sites=(), root_body=1,
        use_acceleration=True, use_rate=True, use_orientation=False, use_range=False,
        use_border=border, force_weights=CONSISTENT, smoothness_order=2, inertial_loss="none",
        range_loss="none",
    )  # fmt: skip
    weights = Weights(
        step=np.asarray(1 / RATE_HZ), inertial_scale=np.asarray(5.0),
        range_scale=np.asarray(3.0), range_mu=np.asarray(1.0), limit_softness=np.asarray(0.01),
    )  # fmt: skip
    problem = SequenceProblem(layout, body, terms, weights, CONSTANT_SIGMA[None] ** -2)
    three = np.zeros((1, 3))
    constants = Constants(
        gyroscope_bias=three, accelerometer_bias=three, mounting=np.eye(3)[None], offset=three
    )
    aside = 0.05 * np.sin(0.7 * time[:, None] + np.arange(6))
    beside = jax.vmap(lambda a, d: retract(body.topology, a, d))(q, jnp.asarray(aside))
    return FreeRoot(body, problem, State(np.asarray(beside), constants), terms)


def _truth(
    body: Body, time: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poses (t, nq) and the board's exact specific force and rate (t, 3)."""
    amplitude = rng.uniform(0.2, 0.5, 6)
    frequency = rng.uniform(0.3, 1.0, 6)

    def pose(t: jax.Array) -> jax.Array:
        s = jnp.clip((t - REST_SECONDS) / 1.5, 0, 1)
        blend = s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)
        swing = blend * amplitude * jnp.sin(2 * jnp.pi * frequency * (t - REST_SECONDS))
        return retract(body.topology, body.qpos0, swing)

    def velocity(t: jax.Array) -> jax.Array:
        q, dq = jax.jvp(pose, (t,), (jnp.ones_like(t),))
        return velocity_to_tangent(body.topology, q, dq)

    def board(t: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
        v, a = jax.jvp(velocity, (t,), (jnp.ones_like(t),))
        m = site_motion(body, pose(t), v, a)
        R = m.rotation[0].T
        return pose(t), R @ (m.acceleration[0] - body.gravity), R @ m.angular_velocity[0]

    return tuple(np.asarray(x) for x in jax.jit(jax.vmap(board))(jnp.asarray(time)))


@partial(jax.jit, static_argnums=0)
def _rows(
    layout: Layout, body: Body, constants: Constants, window: jax.Array, data: dict[str, jax.Array]
) -> tuple[jax.Array, jax.Array]:
    """Whitened residuals (t, n) of windows of three frames and their Jacobians (t, n, 18 + 12)."""
    h = jnp.asarray(1 / RATE_HZ)

    def residual(delta: jax.Array, q: jax.Array, d: dict[str, jax.Array]) -> jax.Array:
        poses = jax.vmap(lambda a, b: retract(body.topology, a, b))(q, delta[:18].reshape(3, 6))
        c = moved_constants(layout, constants, delta[18:]) if layout.use_border else constants
        R, p = jax.vmap(lambda x: site_frames(body, x))(poses)
        p = p[:, 0] + R[:, 0] @ c.offset[0]
        R = R[:, 0] @ c.mounting[0]
        acceleration = acceleration_residual(
            p, R, d["force"], c.accelerometer_bias[0], body.gravity, h
        )
        rate = rate_residual(R[:2], d["mean_rate"], d["rate"], c.gyroscope_bias[0], h)
        steps = jax.vmap(lambda a, b: difference(body.topology, a, b))(poses[:-1], poses[1:])
        return jnp.concatenate([
            d["force_root"] * acceleration, d["rate_root"] * rate,
            d["smoothness_root"] * (steps[1] - steps[0]) / h**2,
            d["reference_root"] * difference(body.topology, body.qpos0, poses[0]),
        ])  # fmt: skip

    zero = jnp.zeros(18 + layout.constants)
    value = jax.vmap(lambda q, d: residual(zero, q, d))(window, data)
    jacobian = jax.vmap(lambda q, d: jax.jacfwd(residual)(zero, q, d))(window, data)
    return value, jacobian


def _windows(case: FreeRoot) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Poses and measurements of windows k, k + 1, k + 2; two empty frames are appended."""
    t, terms = len(case.state.q), case.terms

    def three(x: np.ndarray, mode: str) -> np.ndarray:
        padded = np.pad(x, [(0, 2)] + [(0, 0)] * (x.ndim - 1), mode=mode)
        return np.stack([padded[i : i + t] for i in range(3)], axis=1)

    force, rate = three(terms.force[:, 0], "constant"), three(terms.rate[:, 0], "constant")
    centre = lambda x: np.sqrt(three(x, "constant")[:, 1])  # noqa: E731
    return three(case.state.q, "edge"), {
        "force": force, "rate": rate[:, :2], "mean_rate": terms.mean_rate[:, 0],
        "force_root": centre(terms.force_information), "rate_root": np.sqrt(terms.rate_information),
        "smoothness_root": centre(terms.smoothness_information),
        "reference_root": np.sqrt(terms.reference_information[0]),
    }  # fmt: skip


def reference_step(case: FreeRoot, *, border: bool) -> tuple[np.ndarray, np.ndarray]:
    """Least-squares step by QR of J, frame after frame in extended precision.

    Eliminating frame k's columns leaves a triangle that couples frames k + 1, k + 2, the
    constants and the right-hand side; the rows of the next frame are stacked below it.
    """
    value, jacobian = (
        np.asarray(x)
        for x in _rows(case.problem.layout, case.body, case.state.constants, *_windows(case))
    )
    t, m = len(value), 12 * border
    carry = np.zeros((0, 12 + m + 1), np.longdouble)
    done = []
    for k in range(t):
        rows = np.concatenate([jacobian[k], -value[k][:, None]], axis=1).astype(np.longdouble)
        wide = np.zeros((len(carry), 18 + m + 1), np.longdouble)
        wide[:, :12], wide[:, 18:] = carry[:, :12], carry[:, 12:]
        triangle = householder(np.concatenate([wide, rows]))
        done.append(triangle[:6])
        carry = triangle[6:, 6:]
    # What is left concerns two frames past the end (zero) and the constants.
    rest = carry[:, 12:]
    if m:
        prior = np.zeros((m, m + 1), np.longdouble)
        prior[:, :m] = np.diag(1 / CONSTANT_SIGMA)
        rest = householder(np.concatenate([rest, prior]))
    z = _back(rest[:m, :m], rest[:m, m])
    x = np.zeros((t + 2, 6), np.longdouble)
    for k in range(t - 1, -1, -1):
        r = done[k]
        known = r[:, 6:18] @ x[k + 1 : k + 3].ravel() + r[:, 18 : 18 + m] @ z
        x[k] = _back(r[:, :6], r[:, -1] - known)
    return x[:t].astype(float), z.astype(float)


def householder(a: np.ndarray) -> np.ndarray:
    """Upper triangle (rank rows at most) of a by Householder reflections, any float type."""
    a = np.array(a)
    rows, columns = a.shape
    for j in range(min(rows - 1, columns)):
        v = a[j:, j].copy()
        norm = np.sqrt(v @ v)
        if norm == 0:
            continue
        v[0] += norm if v[0] >= 0 else -norm
        a[j:, j:] -= np.outer(v, (2 / (v @ v)) * (v @ a[j:, j:]))
        a[j + 1 :, j] = 0
    return a[: min(rows, columns)]


def _back(r: np.ndarray, rhs: np.ndarray) -> np.ndarray:
    x = np.zeros_like(rhs)
    for i in range(len(rhs) - 1, -1, -1):
        x[i] = (rhs[i] - r[i, i + 1 :] @ x[i + 1 :]) / r[i, i]
    return x

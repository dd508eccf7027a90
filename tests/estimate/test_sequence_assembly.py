"""Assembled normal equations against dense Jacobians by JAX through the plain residuals."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax import so3
from mocap_jax.body import load_body, normalise, retract
from mocap_jax.estimate.sequence import (
    contact_terms,
    gravity_terms,
    inertial_residuals,
    pose_prior_terms,
    pose_terms,
    range_terms,
)
from mocap_jax.estimate.sequence.assemble import _cost, kinematics
from mocap_jax.estimate.sequence.constants import Constants, Corrections, Geometry
from mocap_jax.estimate.sequence.layout import Gaussian, Ground, Layout, Terms, Weights
from mocap_jax.estimate.sequence.model_gradient import moved_constants
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.estimate.sequence.user_residuals import UserResidual
from mocap_jax.residuals.inertial import CONSISTENT

BODY = """<mujoco><worldbody><body name="pelvis" pos="0 0 1"><freejoint/><geom size=".1"/>
<site name="s0" pos=".1 .2 .05" quat="1 .3 .2 .3"/>
<body name="thigh" pos="0 .1 -.1"><joint type="ball"/><geom size=".1"/>
<site name="s1" pos="0 .1 -.2"/><body name="shank" pos="0 0 -.4">
<joint axis="0 1 .2" range="-1 .2" limited="true"/><geom size=".1"/>
<site name="s2" pos=".1 0 -.2" quat="1 0 1 0"/></body></body>
<body name="chest" pos="0 0 .3"><joint axis="1 0 0" pos="0 0 -.1"/><joint axis="0 0 1"/>
<geom size=".1"/><site name="s3" pos=".1 0 .1"/>
<site name="source" pos=".1 .1 .2" quat="1 .2 0 .4"/>
</body></body></worldbody></mujoco>"""
T, S, K = 9, 4, 3
M = 12 * S + 2 + 3 + 1 + 2
# Every further error of boards; biases walk in two steps.
CORRECTIONS = {
    "use_accelerometer_scale": True, "use_gyroscope_scale": True, "use_clock_offset": True,
    "use_heading": True, "gyroscope_steps": 2, "accelerometer_steps": 2,
}  # fmt: skip


def _user(body, window, data):
    return jnp.array([window[0, 7] - window[1, 8] ** 2, window[2, 0] * data])


def _joints(topology, *names: str) -> tuple[tuple[int, int], ...]:
    """All with the pelvis as parent: one of them over two joints, one of two hinges."""
    return tuple((topology.body_index(n), topology.body_index("pelvis")) for n in names)


def _usual(draw) -> Gaussian:
    turn = lambda: np.array(so3.exp(jnp.asarray(draw(3, 3))))  # noqa: E731
    return Gaussian(turn(), turn(), draw(9, 9), draw(9, 9))


def make(
    order: int, *, losses: str = "none", user: bool = False, chunk: int = 16,
    corrections: dict | None = None, feet: bool = False, gravity: bool = False,
    measured: bool = False,
):  # fmt: skip
    """A random problem in which every kind of residual is present, feet and gravity if wanted."""
    body = load_body(BODY)
    rng = np.random.default_rng(order)
    draw = lambda *shape: rng.normal(size=shape)  # noqa: E731
    top = body.topology
    base = np.array(normalise(top, jnp.asarray(np.array(body.qpos0) + 0.3 * draw(body.nq))))
    move = jax.vmap(lambda d: retract(top, jnp.asarray(base), d))
    q = np.array(move(jnp.asarray(0.15 * draw(T, body.nv))))
    source = body.site_index("source")
    sites = tuple(body.site_index(f"s{i}") for i in range(4))
    layout = Layout(
        top, sites, (*sites, source), 1, True, True, True, True, True, CONSISTENT, order,
        losses, losses, (UserResidual("mine", _user, 3),) if user else (), chunk,
        lengths=tuple(top.body_index(n) for n in ("shank", "chest")), sources=(4,), use_sound=True,
        emitters=(3, 4), pose_joints=_joints(top, "thigh", "shank", "chest"), **(corrections or {}),
    )  # fmt: skip
    inside = lambda x, a, b: x * (np.arange(T) >= a)[:, None] * (np.arange(T) < T - b)[:, None]  # noqa: E731
    positive = lambda *shape: rng.uniform(0.5, 2.0, size=shape)  # noqa: E731
    user_mask = np.ones(T)
    user_mask[-2:] = 0
    terms = Terms(
        force=5 * draw(T, S, 3), force_information=inside(positive(T, S), 1, 1),
        rate=draw(T, S, 3), mean_rate=draw(T, S, 3),
        rate_information=inside(positive(T, S), 0, 1),
        orientation=np.array(so3.exp(jnp.asarray(draw(T, S, 3)))),
        orientation_information=positive(T, S),
        range_distance=positive(T, K), range_information=inside(positive(T, K), 1, 0),
        range_source=np.tile([4, 4, 3], (T, 1)), range_receiver=rng.integers(0, 3, (T, K)),
        range_lead=rng.uniform(size=(T, K)), range_flight=rng.uniform(size=(T, K)),
        reference=np.stack([np.roll(q, 1, 0), np.roll(q, 2, 0)]),
        reference_information=rng.uniform(size=(2, T, body.nv)),
        smoothness_information=inside(positive(T, body.nv), 1, order - 1) * 1e-6,
        limit_information=np.full(T, 3.0), pose_information=positive(T),
        pace_information=np.append(positive(T - 1), 0.0),
        user_data=(np.asarray(draw(T)),) if user else (), user_mask=(user_mask,) if user else (),
    )  # fmt: skip
    weights = Weights(*(np.asarray(x) for x in (0.2, 1.5, 1.5, 1.0, 0.1)), _usual(draw))
    if corrections:
        slopes = lambda: (draw(T, S, 3), draw(T, S, 3))  # noqa: E731
        terms = dataclasses.replace(
            terms, force_slopes=slopes(), rate_slopes=slopes(), mean_rate_slopes=slopes(),
            walk=(draw(T, 2),),
            orientation_information=inside(terms.orientation_information, 1, 1),
        )  # fmt: skip
    if feet:
        names = ("shank", "shank", "chest")
        layout = dataclasses.replace(
            layout, contact_bodies=tuple(top.body_index(n) for n in names), contact_loss=losses
        )
        stands = np.arange(T)[:, None] % 3 > 0
        info = (inside(positive(T, 3), 0, 1), stands * positive(T, 3), ~stands * positive(T, 3))
        terms = dataclasses.replace(terms, contact=info)
        numbers = (np.asarray(x) for x in (0.6, 0.7, 0.3, 2.0))
        weights = dataclasses.replace(weights, ground=Ground(0.2 * draw(3, 3), *numbers))
    layout = dataclasses.replace(layout, measured_rotation=measured)
    if gravity:
        still = (10 * draw(T, S, 3), positive(T, S) * (rng.uniform(size=(T, S)) > 0.3))
        layout = dataclasses.replace(layout, use_gravity=True, gravity_loss=losses)
        terms = dataclasses.replace(terms, gravity=still)
        weights = dataclasses.replace(weights, gravity_scale=np.asarray(0.4))
    constants = Constants(
        0.1 * draw(S, 3),
        0.2 * draw(S, 3),
        np.array(so3.exp(jnp.asarray(0.2 * draw(S, 3)))),
        0.05 * draw(S, 3),
        Geometry(0.1 * draw(2), 0.05 * draw(1, 3), 0.1 * draw(1), 0.1 * draw(2)),
        Corrections(**{
            f.name: 0.1 * draw(S, layout.sensor_sizes[f.name])
            for f in dataclasses.fields(Corrections)
        }),
    )  # fmt: skip
    problem = SequenceProblem(layout, body, terms, weights, np.zeros(layout.constants))
    return problem, State(q, constants)


def moved(problem: SequenceProblem, state: State, delta: jax.Array):
    """Poses and constants at a tangent step, traceable."""
    nv, layout = problem.layout.topology.nv, problem.layout
    step = delta[: T * nv].reshape(T, nv)
    q = jax.vmap(lambda a, b: retract(layout.topology, a, b))(jnp.asarray(state.q), step)
    return q, moved_constants(layout, state.constants, delta[T * nv :])


def stacked_residuals(problem: SequenceProblem, state: State, delta: jax.Array) -> jax.Array:
    """All whitened residuals as one vector, traceable; needs a single chunk."""
    layout = problem.layout
    q, constants = moved(problem, state, delta)
    h = layout.halo
    behind = layout.chunk + h - T
    q = jnp.concatenate([jnp.repeat(q[:1], h, 0), q, jnp.repeat(q[-1:], behind, 0)])
    terms, core = problem.chunked.padded, slice(h, h + layout.chunk)
    w = kinematics(layout, problem.body, q, constants)
    _, (inertial, ranges, pose) = _cost(
        layout, problem.body, w, q, constants, terms, problem.weights
    )
    before = slice(core.start - 1, core.stop - 1)
    root = jnp.sqrt
    usual = pose_prior_terms.residual(w, problem.weights)
    parts = [
        root(terms.force_information[core])[..., None] * inertial.acceleration[before],
        root(terms.rate_information[core])[..., None] * inertial.rate[core],
        root(terms.orientation_information[core])[..., None] * inertial.orientation[core],
        root(terms.range_information[core]) * ranges.residual[before],
        root(terms.reference_information[:, core]) * pose.reference[:, core],
        root(terms.limit_information[core])[:, None] * pose.limits[core],
        root(terms.smoothness_information[core]) * pose.smoothness[before],
        root(terms.pose_information[core])[:, None]
        * pose_prior_terms.whitened(usual[core], problem.weights),
        root(terms.pace_information[core])[:, None]
        * pose_prior_terms.changes(usual, problem.weights)[core],
    ]
    if layout.use_gravity:
        tilt = gravity_terms.residuals(layout, w, constants, terms, problem.body.gravity)
        parts.append(root(terms.gravity[1][core])[..., None] * tilt[core])
    if layout.contact_bodies:
        kinds = contact_terms.kinds(layout, w, terms, problem.weights, core)
        parts += [root(k.information) * k.residual for k in kinds]
    for user, data, mask in zip(layout.user, terms.user_data, terms.user_mask, strict=True):
        parts.append(pose_terms.user_values(layout, problem.body, user, q, data, mask)[core])
    return jnp.concatenate([p.ravel() for p in parts])


def dense(equations, frames: int):
    """Dense matrix of assembled normal equations."""
    lower, d = equations.lower, equations.lower.shape[2]
    m = len(equations.corner_gradient)
    out = np.zeros((frames * d + m, frames * d + m))
    for k in range(frames):
        for o in range(min(lower.shape[1], frames - k)):
            rows, cols = slice((k + o) * d, (k + o + 1) * d), slice(k * d, (k + 1) * d)
            out[rows, cols], out[cols, rows] = lower[k, o], lower[k, o].T
        out[frames * d :, k * d : (k + 1) * d] = equations.border(k)
    out[: frames * d, frames * d :] = out[frames * d :, : frames * d].T
    out[frames * d :, frames * d :] = equations.corner
    return out


@pytest.mark.parametrize(
    ("order", "user", "corrections", "present"),
    [
        (2, False, None, ""), (3, True, None, ""), (2, False, CORRECTIONS, "gravity"),
        (2, False, {"use_heading": True}, ""), (2, False, None, "feet"),
        (2, False, {"use_accelerometer_scale": True, "accelerometer_steps": 2}, "measured"),
    ],
)  # fmt: skip
def test_normal_equations_equal_dense_jacobian(
    order: int, user: bool, corrections: dict | None, present: str
) -> None:
    more = {present: True} if present else {}
    problem, state = make(order, user=user, corrections=corrections, **more)
    zero = jnp.zeros(problem.unknowns)
    function = jax.jit(lambda d: stacked_residuals(problem, state, d))
    residual = np.asarray(function(zero))
    jacobian = np.asarray(jax.jit(jax.jacfwd(function))(zero))
    equations = problem.linearise(state)
    gradient = np.concatenate([equations.gradient.ravel(), equations.corner_gradient])
    np.testing.assert_allclose(equations.cost, 0.5 * residual @ residual, rtol=1e-12)
    np.testing.assert_allclose(equations.cost, problem.cost(state), rtol=1e-12)
    np.testing.assert_allclose(gradient, jacobian.T @ residual, rtol=1e-9, atol=1e-7)
    square = jacobian.T @ jacobian
    np.testing.assert_allclose(dense(equations, T), square, rtol=1e-9, atol=1e-9 * square.max())


def test_corrections_that_are_off_leave_the_other_equations_as_they_are() -> None:
    """With all of them at zero, rows and columns of the others are the same to rounding."""
    with_them, state = make(2, corrections=CORRECTIONS)
    plain, _ = make(2)
    plain.replace_terms(orientation_information=with_them.terms.orientation_information)
    c = dataclasses.replace(
        state.constants,
        corrections=Corrections(**{
            f.name: 0 * getattr(state.constants.corrections, f.name)
            for f in dataclasses.fields(Corrections)
        }),
    )  # fmt: skip
    a = with_them.linearise(State(state.q, c))
    b = plain.linearise(State(state.q, dataclasses.replace(c, corrections=Corrections())))
    width, poses, n = with_them.layout.per_sensor, T * plain.layout.topology.nv, len(dense(a, T))
    own = poses + width * np.arange(S)[:, None] + np.arange(12)
    kept = np.concatenate([np.arange(poses), own.ravel(), np.arange(poses + width * S, n)])
    square = dense(b, T)
    np.testing.assert_allclose(
        dense(a, T)[np.ix_(kept, kept)], square, rtol=1e-12, atol=1e-12 * square.max()
    )
    assert len(square) == poses + M and a.cost == pytest.approx(b.cost, rel=1e-12)


def test_blocks_are_final_when_they_are_handed_over() -> None:
    problem, state = make(2, chunk=4)
    expected, stops = np.array(problem.linearise(state).lower), []

    def follow(lower, border, ready: int) -> None:
        np.testing.assert_array_equal(lower[:ready], expected[:ready])
        assert border(ready - 1).any()
        stops.append(ready)

    problem.linearise(state, follow)
    assert stops == [4, 8, T]


@pytest.mark.parametrize("loss", ["huber", "cauchy", "geman_mcclure"])
def test_gradient_of_robust_cost(loss: str) -> None:
    problem, state = make(2, losses=loss, feet=True, gravity=True)
    equations = problem.linearise(state)
    rng = np.random.default_rng(0)
    step, constants = rng.normal(size=(T, problem.layout.topology.nv)), rng.normal(size=M)
    slope = (equations.gradient * step).sum() + equations.corner_gradient @ constants
    e = 1e-6
    ahead = problem.cost(problem.move(state, e * step, e * constants))
    behind = problem.cost(problem.move(state, -e * step, -e * constants))
    np.testing.assert_allclose(slope, (ahead - behind) / (2 * e), rtol=1e-6)


def test_chunks_do_not_change_the_equations() -> None:
    whole, state = make(3, user=True, feet=True, gravity=True)
    pieces, _ = make(3, user=True, chunk=4, feet=True, gravity=True)
    a, b = whole.linearise(state), pieces.linearise(state)
    np.testing.assert_allclose(a.cost, b.cost, rtol=1e-12)
    np.testing.assert_allclose(dense(a, T), dense(b, T), rtol=1e-10, atol=1e-8)
    np.testing.assert_allclose(a.gradient, b.gradient, rtol=1e-9, atol=1e-8)


@pytest.mark.parametrize("corrections", [None, CORRECTIONS])
def test_products_with_the_border_equal_those_with_its_blocks(corrections: dict | None) -> None:
    problem, state = make(2, corrections=corrections, feet=True)
    e = problem.linearise(state)
    blocks = np.stack([e.border(k) for k in range(T)])
    rng = np.random.default_rng(3)
    x, z = rng.normal(size=e.gradient.shape), rng.normal(size=len(e.corner_gradient))
    times, pulled = np.einsum("kmd,m->kd", blocks, z), np.einsum("kmd,kd->m", blocks, x)
    np.testing.assert_allclose(e.border.times(z), times, rtol=1e-9, atol=1e-9 * abs(times).max())
    np.testing.assert_allclose(e.border.pulled(x), pulled, rtol=1e-9, atol=1e-9 * abs(pulled).max())


def test_border_can_be_left_out() -> None:
    problem, state = make(2)
    without = SequenceProblem(
        dataclasses.replace(
            problem.layout,
            use_border=False,
            lengths=(),
            sources=(),
            use_sound=False,
            emitters=(),
        ),
        problem.body,
        jax.tree.map(lambda x: x, _unpadded(problem)),
        problem.weights,
        np.zeros(0),
    )
    state = State(state.q, dataclasses.replace(state.constants, geometry=Geometry()))
    problem.layout = dataclasses.replace(
        problem.layout, lengths=(), sources=(), use_sound=False, emitters=()
    )
    problem.prior_information = np.zeros(12 * S)
    problem.readings = (np.zeros(12 * S), np.zeros(12 * S))
    a, b = problem.linearise(state), without.linearise(state)
    np.testing.assert_allclose(a.lower, b.lower, rtol=1e-10, atol=1e-9)
    assert b.border is None and len(b.corner_gradient) == 0


def _unpadded(problem: SequenceProblem) -> Terms:
    h = problem.layout.halo
    fields = {}
    for f in dataclasses.fields(Terms):
        value = getattr(problem.chunked.padded, f.name)
        axis = 1 if f.name in ("reference", "reference_information") else 0
        fields[f.name] = jax.tree.map(
            lambda x, axis=axis: np.take(np.asarray(x), range(h, h + T), axis), value
        )
    return Terms(**fields)


def test_gate_sees_only_what_is_in_front() -> None:
    problem, state = make(2)
    gate = problem.gate(state)
    assert gate.shape == (T, K)
    assert set(np.unique(gate)) <= {0.0, 1.0}
    assert range_terms.gate is not None and inertial_residuals.residuals is not None


def test_least_damping_grows_with_the_boards_information_and_ignores_short_holds():
    problem, _ = make(2)
    plain = problem.least_damping
    force = np.asarray(problem.chunked.padded.force_information)
    problem.replace_terms(force_information=1e9 * force[: problem.frames])
    assert problem.least_damping > 1e3 * plain
    held = np.zeros_like(force[: problem.frames])
    held[: problem.frames // 4] = 1e9
    problem.replace_terms(force_information=held)
    assert problem.least_damping <= plain


def test_jitter_of_joints_that_move_no_sensor_is_not_damped():
    problem, _ = make(2)
    layout = problem.layout
    sites = np.array(layout.topology.site_body)[[*layout.sites, *layout.range_sites]]
    free = np.flatnonzero(~problem.bends)
    assert not layout.topology.body_dofs[np.ix_(sites, free)].any()
    assert layout.topology.body_dofs[sites].any(axis=0)[problem.bends].any()

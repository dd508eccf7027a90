"""The tangent rule of `frames` against finite differences and against JAX through the tree.

Tolerances: central differences 1e-6, derivatives traced through the tree 1e-10 (first order) and
1e-9 (second order), relative where the values exceed one. The poses include joints that have
turned by nothing, by 1e-7 rad and by (almost) half a turn.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from sample_bodies import poses_at_angle, random_states, sample_body, worst

from mocap_jax.body import frames, retract, site_frames
from mocap_jax.body.kinematics import plain_frames

ANGLES = (0.0, 1e-7, 1.0, np.pi - 1e-7, np.pi, np.pi + 1e-7)
PARAMETERS = ("body_pos", "body_quat", "joint_pos", "joint_axis", "qpos0")
body = sample_body("mixed")
poses = np.stack(
    [*(poses_at_angle(body, angle) for angle in ANGLES), *random_states(body, 6, seed=1)[0]]
)


def plain(changed, q):
    return plain_frames(body.topology, tuple(getattr(changed, name) for name in PARAMETERS), q)


def ruled(q):
    return frames(body, q)


def traced(q):
    return plain(body, q)


def over_poses(function):
    return jax.jit(jax.vmap(function))(poses)


def assert_close(ours, reference, tolerance: float) -> None:
    for name, a, b in zip(ours._fields, ours, reference, strict=True):
        assert np.isfinite(a).all(), name
        assert worst(a, b) < tolerance, name


def test_rule_agrees_with_central_differences() -> None:
    step = 1e-5
    zero = jnp.zeros(body.nv)

    def derivative(q):
        return jax.jacfwd(lambda d: frames(body, retract(body.topology, q, d)))(zero)

    @jax.vmap
    def moved(q, delta):
        return frames(body, retract(body.topology, q, delta))

    @jax.jit
    def numerical(q):
        steps = step * jnp.eye(body.nv)
        every = jnp.broadcast_to(q, (body.nv, body.nq))
        change = jax.tree.map(lambda a, b: a - b, moved(every, steps), moved(every, -steps))
        return jax.tree.map(lambda c: jnp.moveaxis(c / (2 * step), 0, -1), change)

    assert_close(over_poses(derivative), jax.vmap(numerical)(poses), 1e-6)


def test_rule_agrees_with_derivatives_through_the_tree() -> None:
    assert_close(over_poses(jax.jacfwd(ruled)), over_poses(jax.jacfwd(traced)), 1e-10)


def test_reverse_mode_agrees_with_forward_mode() -> None:
    assert_close(over_poses(jax.jacrev(ruled)), over_poses(jax.jacfwd(traced)), 1e-10)


@pytest.mark.slow
def test_second_derivatives_agree_with_those_through_the_tree() -> None:
    second = over_poses(jax.jacfwd(jax.jacfwd(ruled)))
    assert_close(second, over_poses(jax.jacfwd(jax.jacfwd(traced))), 1e-9)


@pytest.mark.slow
def test_rule_on_the_humanoid(shared_data) -> None:
    humanoid = sample_body("dm_control_humanoid", shared_data)
    q, v, _ = random_states(humanoid, 50)
    q_dot = jax.jit(jax.vmap(lambda q, v: jax.jvp(
        lambda t: retract(humanoid.topology, q, t * v), (0.0,), (1.0,))[1]))(q, v)  # fmt: skip
    parameters = tuple(getattr(humanoid, name) for name in PARAMETERS)

    def along(function):
        return jax.jit(jax.vmap(lambda q, d: jax.jvp(function, (q,), (d,))[1]))(q, q_dot)

    assert_close(
        along(lambda q: frames(humanoid, q)),
        along(lambda q: plain_frames(humanoid.topology, parameters, q)),
        1e-10,
    )


def loss(f, q) -> jax.Array:
    """A scalar in which every output takes part."""
    parts = [jnp.sum(jnp.sin(x + 0.1 * jnp.arange(x.size).reshape(x.shape))) for x in f]
    return sum(parts) + 0.0 * q.sum()


@pytest.mark.parametrize("name", PARAMETERS)
def test_gradient_with_respect_to_body_parameters(name: str) -> None:
    value = getattr(body, name)

    def gradient(function):
        return over_poses(lambda q: jax.grad(
            lambda x: loss(function(body.replace(**{name: x}), q), q))(value))  # fmt: skip

    ours, reference = gradient(frames), gradient(plain)
    assert np.isfinite(ours).all()
    assert np.abs(reference).max() > 1e-3
    assert worst(ours, reference) < 1e-10


def test_gradient_with_respect_to_pose_and_parameters_together() -> None:
    direction = jnp.asarray(np.random.default_rng(3).normal(size=body.joint_axis.shape))

    def mixed(function):
        def slope(q):
            return jax.jvp(
                lambda x: loss(function(body.replace(joint_axis=x), q), q),
                (body.joint_axis,), (direction,),
            )[1]  # fmt: skip

        return over_poses(jax.grad(slope))

    assert worst(mixed(frames), mixed(plain)) < 1e-9


def test_gradient_with_respect_to_site_positions_is_the_rotation_of_the_body() -> None:
    q = poses[-1]
    jacobian = jax.jit(jax.jacfwd(
        lambda x: site_frames(body.replace(site_pos=x), q).position))(body.site_pos)  # fmt: skip
    on = np.array(body.topology.site_body)
    expected = np.zeros_like(jacobian)
    for site, R in enumerate(np.asarray(frames(body, q).rotation)[on]):
        expected[site, :, site] = R
    np.testing.assert_allclose(jacobian, expected, atol=1e-12)

"""The pose prior's residual against SciPy's rotations."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import load_body
from mocap_jax.estimate.sequence import pose_prior_terms
from mocap_jax.pose_prior import PosePrior
from mocap_jax.residuals.pose_prior import pose_prior_rotation


def _draw(seed: int, count: int) -> Rotation:
    return Rotation.random(count, random_state=seed)


def test_against_scipy() -> None:
    child, parent, frame, mean = (_draw(i, 5) for i in range(4))
    found = pose_prior_rotation(*(jnp.asarray(r.as_matrix()) for r in (child, parent, frame, mean)))
    expected = ((parent * mean).inv() * child * frame).as_rotvec()
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_slope_at_the_mean_is_finite() -> None:
    eye = jnp.eye(3)[None]

    def squared(x: jax.Array) -> jax.Array:
        turned = jax.scipy.linalg.expm(jnp.array([[0, -x, 0], [x, 0, 0], [0, 0, 0]]))[None]
        return (pose_prior_rotation(turned, eye, eye, eye) ** 2).sum()

    assert float(jax.grad(squared)(0.0)) == 0.0
    np.testing.assert_allclose(float(jax.grad(jax.grad(squared))(0.0)), 2.0, rtol=1e-6)


def test_a_turn_past_the_end_of_the_chart_is_no_motion():
    """From just below half a turn to just above: the vector jumps by a turn, the joint does not."""
    below, above = (Rotation.from_rotvec([0, a, 0]).as_rotvec() for a in (3.1, 3.2))
    before = np.array([[below, [0.1, 0.2, 0.3]]])
    after = np.array([[above, [0.2, 0.2, 0.1]]])
    assert np.linalg.norm(above - below) > 6
    np.testing.assert_allclose(
        pose_prior_terms.moved(jnp.asarray(before), jnp.asarray(after)),
        [[0, 0, 0, 0.1, 0, -0.2]], atol=1e-12,
    )  # fmt: skip


def test_slides_stay_with_the_weak_prior():
    """A trunk that also slides along itself: the prior of its rotation does not hold that."""
    body = load_body("""<mujoco><worldbody><body name="Pelvis"><freejoint/><geom size=".1"/>
    <body name="T8" pos="0 0 .4"><joint type="slide" axis="0 0 1"/><joint type="ball"/>
    <geom size=".1"/></body></body></worldbody></mujoco>""")
    prior = PosePrior((("T8", "Pelvis"),), np.eye(4)[:1], np.eye(3), 1.0)
    inside = pose_prior_terms.on_body(body, prior, 0.1).inside
    np.testing.assert_array_equal(inside, [False] * 7 + [True] * 3)

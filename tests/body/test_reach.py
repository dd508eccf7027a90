"""How far apart two sites can be, against poses drawn at random."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mocap_jax.body import load_body, reach

CHAIN = """
<mujoco>
  <worldbody>
    <body name="base" pos="0 0 1">
      <freejoint name="root"/>
      <geom size=".1"/>
      <site name="low" pos=".02 .01 -.2"/>
      <site name="high" pos="0 0 .1"/>
      <body name="upper" pos=".1 .2 .15" quat=".8 .6 0 0">
        <joint name="shoulder" type="ball" pos=".01 .02 0"/>
        <geom size=".05"/>
        <site name="upper" pos=".1 .03 .02"/>
        <body name="lower" pos=".3 0 0">
          <joint name="bend" axis="0 0 1" pos="-.01 0 .02"/>
          <joint name="turn" axis="1 0 0" pos=".03 .01 0"/>
          <geom size=".05"/>
          <site name="lower" pos=".2 0 .04"/>
        </body>
      </body>
      <body name="other" pos="0 -.2 .15">
        <joint name="shrug" type="ball"/>
        <geom size=".05"/>
        <site name="other" pos="0 -.1 0"/>
      </body>
      <body name="rail" pos="0 0 .3">
        <joint name="rail" type="slide"/>
        <geom size=".05"/>
        <site name="rail"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
SITES = ("low", "high", "upper", "lower", "other")


@pytest.fixture(scope="module")
def chain():
    return load_body(CHAIN)


def test_no_pose_exceeds_the_bound_and_some_come_near_it(chain):
    model = chain.mujoco_model()
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    farthest = np.zeros((len(SITES), len(SITES)))
    at = [chain.site_index(s) for s in SITES]
    for _ in range(4000):
        data.qpos = rng.standard_normal(model.nq) * np.pi
        mujoco.mj_kinematics(model, data)
        p = data.site_xpos[at]
        farthest = np.maximum(farthest, np.linalg.norm(p[:, None] - p[None], axis=2))
    bound = np.array([[reach(chain, i, j) for j in at] for i in at])
    assert (farthest <= bound + 1e-9).all()
    np.testing.assert_allclose(bound, bound.T, atol=1e-12)
    assert farthest[0, 1] == pytest.approx(bound[0, 1])  # on one segment
    assert farthest[1, 2] > 0.98 * bound[1, 2]  # one ball joint between them
    assert farthest[2, 4] > 0.9 * bound[2, 4]  # one on either side


def test_what_slides_or_floats_has_no_bound(chain):
    two = CHAIN.replace(
        "</worldbody>",
        '<site name="wall"/><body name="free"><freejoint/><geom size=".1"/>'
        '<site name="free"/></body></worldbody>',
    )
    assert reach(chain, chain.site_index("low"), chain.site_index("rail")) == np.inf
    pair = load_body(two)
    for other in ("wall", "free"):
        assert reach(pair, pair.site_index("lower"), pair.site_index(other)) == np.inf

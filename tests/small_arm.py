"""A trunk with an arm of two segments, for tests of what needs few of them."""

from __future__ import annotations

_XML = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="{trunk}" pos="0 0 1.2">
      <freejoint name="root"/>
      <geom type="capsule" size="0.1" fromto="0 0 -0.2 0 0 0.2"/>
      <body name="{upper}" pos="0 {side} 0.15">
        <joint name="shoulder" type="ball"/>
        <geom type="capsule" size="0.04" fromto="0 0 0 0.3 0 0"/>
        <body name="{lower}" pos="0.3 0 0">
          <joint name="elbow" axis="0 0 1" range="-0.1 2.6"/>
          <geom type="capsule" size="0.03" fromto="0 0 0 0.25 0 0"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def small_arm(trunk: str, upper: str, lower: str, *, left: bool) -> str:
    """MJCF text, its segments under these names. The arm points forward at the reference pose."""
    return _XML.format(trunk=trunk, upper=upper, lower=lower, side=0.2 if left else -0.2)

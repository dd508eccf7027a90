"""An arm of two links on a fixed shoulder, with an ultrasonic mobile at the wrist.

The sagittal plane is world x (forward) and z (up). At the reference pose the arm points forward; a
shoulder angle raises it and an elbow angle bends it in the same sense, which are the joint angles
of a planar Denavit-Hartenberg chain. As everywhere, the root body gets a free joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from mocap_jax.body import Body, load_body
from mocap_jax.body.mjcf_text import numbers
from mocap_jax.body.site_names import ANCHOR_PREFIX, SOURCE_PREFIX
from mocap_jax.errors import InputError, unknown_name

WRIST_SITE = SOURCE_PREFIX + "wrist"
SHOULDER, ELBOW, ABDUCTION, ROTATION = "shoulder", "elbow", "abduction", "rotation"
Shoulder = Literal["planar", "sagittal", "ball"]
"""Flexion alone; flexion with abduction and axial rotation within `ASIDE`; or a ball joint."""
ASIDE = 0.26
"""How far a shoulder that is told to move in the sagittal plane leaves it [rad]: 15 degrees."""
FLEXION_AXIS = (0.0, -1.0, 0.0)
"""Of raising the arm and of bending the elbow: lateral, to the arm's own side. The mobile sends its
sound there."""
# Of the mobile on the outer side of the wrist [m].
_ON_SKIN = (0.0, -0.04, 0.0)
_TURN = (0.5**0.5, 0.5**0.5, 0.0, 0.0)
_INERTIA = 'mass="1" diaginertia="0.01 0.01 0.01"'


def _aside(name: str) -> str:
    # Both axes are one where the arm points forward: without armature MuJoCo warns of the inertia.
    return f'<joint name="{name}" axis="1 0 0" range="-{ASIDE} {ASIDE}" armature="0.01"/>'


_FLEXION = f'<joint name="{SHOULDER}" axis="{numbers(FLEXION_AXIS)}"/>'
_SHOULDERS: dict[str, str] = {
    "planar": _FLEXION,
    "sagittal": _aside(ABDUCTION) + _FLEXION + _aside(ROTATION),
    "ball": f'<joint name="{SHOULDER}" type="ball"/>',
}
_TISSUE = "".join(
    f'<joint name="mobile_{a}" type="slide" axis="{numbers(v)}"/>'
    for a, v in zip("xyz", ((1, 0, 0), (0, 1, 0), (0, 0, 1)), strict=True)
)


def arm_body(
    anchors: Mapping[str, tuple[float, float, float]],
    *,
    upper_arm: float = 0.30,
    forearm: float = 0.25,
    shoulder: tuple[float, float, float] = (0.0, 0.0, 1.3),
    kind: Shoulder = "planar",
    loose_mobile: bool = False,
) -> Body:
    """A right arm on a root body at the shoulder.

    Args:
        anchors: positions in the world by name [m].
        upper_arm, forearm: lengths of the links [m].
        shoulder: its centre in the world [m].
        kind: of the shoulder, see `Shoulder`.
        loose_mobile: the mobile slides on the wrist (three slides), as a simulated one may.

    Raises:
        InputError: a length that is not positive, no anchor, or an unknown kind of shoulder.
    """
    for name, length in (("upper_arm", upper_arm), ("forearm", forearm)):
        if not length > 0:
            raise InputError(f"{name}={length:g}: the length must be above 0 m")
    if not anchors:
        raise InputError("anchors: at least one is needed")
    sites = "".join(
        f'<site name="{ANCHOR_PREFIX}{n}" pos="{numbers(p)}"/>' for n, p in anchors.items()
    )
    if kind not in _SHOULDERS:
        raise unknown_name("kind of shoulder", kind, _SHOULDERS)
    wrist = f'<site name="{WRIST_SITE}" pos="{numbers(_ON_SKIN)}" quat="{numbers(_TURN)}"/>'
    return load_body(f"""<mujoco model="arm"><compiler angle="radian"/><worldbody>{sites}
  <body name="Trunk" pos="{numbers(shoulder)}"><freejoint name="root"/>
    <inertial pos="0 0 0" {_INERTIA}/>
    <body name="RightUpperArm">{_SHOULDERS[kind]}
      <geom type="capsule" size="0.04" fromto="0.05 0 0 {upper_arm - 0.02} 0 0"/>
      <body name="RightForeArm" pos="{upper_arm} 0 0">
        <joint name="{ELBOW}" axis="{numbers(FLEXION_AXIS)}" range="0 2.62"/>
        <geom type="capsule" size="0.03" fromto="0.02 0 0 {forearm - 0.03} 0 0"/>
        <body name="RightHand" pos="{forearm} 0 0">{_TISSUE if loose_mobile else ""}
          <inertial pos="0 0 0" {_INERTIA}/>
          {wrist}
        </body></body></body></body></worldbody></mujoco>""")

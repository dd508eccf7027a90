"""`joint_recording`: a recording of two sensors on the body that `find_joint` has found."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body.mjcf_text import numbers
from mocap_jax.errors import unknown_name
from mocap_jax.initialise.joint.finding import JointFinding, JointKind
from mocap_jax.recording import Recording, RestHold, SensorSpec

# A rest that holds the first sample alone; files know none of no duration [s].
_INSTANT = 1e-6
KINDS: tuple[JointKind, ...] = ("hinge", "universal", "ball")
_XML = """<mujoco model="two_segments">
  <compiler angle="radian" autolimits="true"/>
  <worldbody>
    <body name="{first}">
      <freejoint name="root"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <site name="{first}" pos="{first_site}"/>
      <body name="{second}" quat="{quat}">
        {joints}
        <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
        <site name="{second}" pos="{second_site}"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def joint_recording(
    recording: Recording, finding: JointFinding, *, kind: JointKind | None = None
) -> Recording:
    """The two sensors' recording with the body found: ready for `optimise` and `ekf`.

    The body has a segment for each sensor, named after it, whose frame is the sensor's, turned as
    it is, with its origin in the joint's centre. A `ball` joint is named `joint`, and so is a
    hinge; a universal joint is `joint_first` (axis fixed in the first segment) and `joint_second`.
    Angles of hinges are zero at the first sample. The pose found there is declared as the pose at
    rest, with a rest of an instant.

    Args:
        recording: that the joint was found in; other sensors are left out.
        finding: of `find_joint`.
        kind: of the body's joint; default the kind found. `ball` is always possible.

    Raises:
        InputError: a kind with axes that were not found.
    """
    kind = finding.kind if kind is None else kind
    possible = tuple(k for k in KINDS if k in (finding.kind, "ball"))
    if kind not in possible:
        raise unknown_name("kind of joint for this finding", kind, possible)
    inertial = {name: recording.inertial[name] for name in finding.sensors}
    magnetic = {n: s for n, s in recording.magnetic.items() if n in inertial}
    rates = {s.name: s.rate_hz for s in recording.setup.sensors}
    sensors = tuple(
        SensorSpec(n, n, rates.get(n, 1.0 / float(np.median(np.diff(np.asarray(s.time))))))
        for n, s in inertial.items()
    )
    start = float(finding.time[0])
    pose = {"root": (0.0, 0.0, 0.0, *map(float, finding.start))}
    if kind == "ball":
        pose["joint"] = tuple(map(float, finding.relative[0]))
    setup = dataclasses.replace(
        recording.setup, sensors=sensors, sources=(), rest=RestHold(start, start + _INSTANT, pose)
    )
    return dataclasses.replace(
        recording, inertial=inertial, magnetic=magnetic, ranges=None, root=None, truth=None,
        setup=setup, body_xml=_xml(finding, kind),
    )  # fmt: skip


def _xml(finding: JointFinding, kind: JointKind) -> str:
    """The body as MJCF."""
    R, joints = np.eye(3), '<joint name="joint" type="ball"/>'
    if kind != "ball":
        R = _at_zero(finding, kind)
        assert finding.first_axis is not None and finding.second_axis is not None
        both = (("joint_first", R.T @ finding.first_axis), ("joint_second", finding.second_axis))
        chosen = both if kind == "universal" else (("joint", finding.second_axis),)
        joints = "".join(f'<joint name="{n}" axis="{numbers(a)}"/>' for n, a in chosen)
    first, second = finding.sensors
    return _XML.format(
        first=first, second=second, joints=joints,
        first_site=numbers(-finding.first_arm), second_site=numbers(-finding.second_arm),
        quat=numbers(Rotation.from_matrix(R).as_quat(scalar_first=True)),
    )  # fmt: skip


def _at_zero(finding: JointFinding, kind: JointKind) -> np.ndarray:
    """Relative orientation at zero angles: the first sample's, with a hinge's axes aligned."""
    R = Rotation.from_quat(finding.relative[0], scalar_first=True)
    if kind == "hinge":
        assert finding.first_axis is not None and finding.second_axis is not None
        seen = R.apply(finding.second_axis)
        turn = np.cross(seen, finding.first_axis)
        size = np.linalg.norm(turn)
        if size > 0:
            angle = np.arctan2(size, seen @ finding.first_axis)
            R = Rotation.from_rotvec(turn / size * angle) * R
    return R.as_matrix()

"""Bodies and random states on which the kinematics is compared with C MuJoCo."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from mocap_jax.body import Body, load_body
from mocap_jax.body.topology import BALL, FREE, HINGE
from mocap_jax.motion import body_from_asf, human

MIXED = """
<mujoco>
  <compiler angle="radian"/>
  <option gravity="0.3 -0.2 -9.7"/>
  <default><geom type="sphere" size="0.02" mass="0.5"/></default>
  <worldbody>
    <site name="fixed" pos="1 2 3" quat="0.5 0.5 0.5 -0.5"/>
    <body name="floating" pos="0.3 0.2 1.1" quat="0.9 0.1 -0.3 0.2">
      <freejoint name="root"/>
      <geom/>
      <site name="on_root" pos="0.1 -0.2 0.05" quat="0.7 0.1 0.2 -0.6"/>
      <body name="ball_offset" pos="0 0.1 0.3" quat="0.3 0.8 0.1 -0.2">
        <joint name="ball" type="ball" pos="0.02 -0.05 0.11"/>
        <geom/>
        <body name="welded" pos="0.2 0 0.1" quat="0.6 0.2 0.7 0.1">
          <geom/>
          <site name="on_welded" pos="0.01 0.02 0.03"/>
          <body name="welded_twice" pos="0.1 0.1 0" euler="0.3 0.2 -0.5">
            <geom/>
            <body name="hinge_ref" pos="-0.1 0.02 0.2">
              <joint name="hinge" axis="1 2 -1" pos="0.1 0.2 0.3" ref="0.7" range="-1 2"/>
              <geom/>
              <site name="on_hinge" pos="0.3 0.1 0.1" quat="0.2 0.9 0.3 0.1"/>
            </body>
          </body>
        </body>
      </body>
      <body name="several" pos="0.05 -0.1 -0.3" euler="1 0.4 2">
        <joint name="several_slide" type="slide" axis="0.2 1 0.4" ref="0.15"/>
        <joint name="several_hinge" axis="0 1 0.3" pos="0.1 0 -0.1"/>
        <joint name="several_other" axis="1 0.1 0" pos="0.03 0.04 0.05" ref="-0.4"/>
        <joint name="several_ball" type="ball" pos="-0.05 0.08 0.02"/>
        <geom/>
        <site name="on_several" pos="-0.2 0.1 0.4"/>
      </body>
    </body>
    <body name="second_tree" pos="-1 0.5 0.2" euler="0.2 0.5 0.8">
      <joint name="second_slide" type="slide" axis="1 1 0"/>
      <joint name="second_other" type="slide" axis="0 0.2 1"/>
      <geom/>
      <body name="second_ball" pos="0.3 0 0.1">
        <joint name="second_ball" type="ball"/>
        <geom/>
        <site name="on_second" pos="0.1 0.2 0.3"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

SAMPLES = ("mixed", "human", "cmu_asf", "dm_control_humanoid")


@cache
def sample_body(name: str, shared_data: Path | None = None) -> Body:
    """A body by its name in `SAMPLES`; the last two are read from the shared data."""
    if name == "mixed":
        return load_body(MIXED)
    if name == "human":
        return with_sites(human())
    if name == "cmu_asf":
        return with_sites(body_from_asf(shared_data / "cmu_mocap" / "02.asf"))
    return load_body(shared_data / "mjcf_humanoid_cmu" / "humanoid_CMU_V2020.xml", free_root=True)


def with_sites(body: Body) -> Body:
    """The body with one turned site off the origin of every segment."""
    tree = ElementTree.fromstring(body.xml)
    for number, element in enumerate(tree.iter("body")):
        ElementTree.SubElement(
            element, "site", name=f"test_{number}", pos="0.05 -0.02 0.1", quat="0.5 0.1 -0.7 0.3"
        )
    return load_body(ElementTree.tostring(tree, encoding="unicode"))


def random_states(body: Body, count: int, seed: int = 0) -> tuple[np.ndarray, ...]:
    """Poses with all angles and attitudes, velocities and accelerations: (q, v, a)."""
    rng = np.random.default_rng(seed)
    topology = body.topology
    q = np.asarray(body.qpos0) + rng.normal(size=(count, topology.nq))
    hinges = topology.joint_qpos[np.array(topology.joint_types) == HINGE]
    q[:, hinges] = rng.uniform(-np.pi, np.pi, (count, hinges.size))
    for quat in topology.quat_index[0]:
        attitude = rng.normal(size=(count, 4))
        q[:, quat] = attitude / np.linalg.norm(attitude, axis=1, keepdims=True)
    v, a = rng.normal(size=(2, count, topology.nv))
    return q, v, 5.0 * a


def poses_at_angle(body: Body, angle: float, seed: int = 0) -> np.ndarray:
    """A pose in which every hinge, ball and free joint has turned by the angle [rad]."""
    q = random_states(body, 1, seed)[0][0]
    topology = body.topology
    for joint, kind in enumerate(topology.joint_types):
        at = topology.joint_qpos[joint]
        if kind == HINGE:
            q[at] = body.qpos0[at] + angle
        elif kind in (BALL, FREE):
            quat = at + (3 if kind == FREE else 0) + np.arange(4)
            axis = q[quat[1:]] / np.linalg.norm(q[quat[1:]])
            q[quat] = np.append(np.cos(angle / 2), np.sin(angle / 2) * axis)
    return q


def worst(ours, reference) -> float:
    """Largest difference, relative to the larger of one and the largest reference value."""
    reference = np.asarray(reference)
    return float(np.abs(np.asarray(ours) - reference).max() / max(1.0, np.abs(reference).max()))

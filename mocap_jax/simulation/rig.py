"""The C MuJoCo model that a recording is measured on: the true body with its sensors."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, Topology, body_from_model
from mocap_jax.simulation.spline import PoseSpline

_TISSUE = "tissue/"
_INERT_MASS = 1e-3


@dataclass(frozen=True)
class Rig:
    """Compiled model, its scratch data, and where the devices are in it."""

    model: mujoco.MjModel
    data: mujoco.MjData
    topology: Topology
    board_sites: np.ndarray
    source_sites: np.ndarray
    microphone_sites: np.ndarray
    """Of the boards, then of the anchors that receive."""
    coordinates: np.ndarray
    """Indices of the body's own q in the model's qpos."""
    tissue_coordinates: np.ndarray
    """Indices in qpos, shape (boards, 7), of each board's displacement and turn (wxyz) on its
    segment; shape (0, 7) when boards are fixed."""


def build_rig(
    body: Body, boards: tuple[str, ...], sources: tuple[str, ...],
    anchors: tuple[str, ...] = (), *, soft_tissue: bool = False,
) -> Rig:  # fmt: skip
    """Compile a body with an accelerometer and a gyroscope at every board's site.

    Args:
        body: the true body.
        boards: site names of the boards.
        sources: site names of the ultrasonic sources.
        anchors: site names of the receivers in the world.
        soft_tissue: put three slides and a ball joint between each board and its segment.
    """
    spec = mujoco.MjSpec.from_string(body.xml)
    for own in list(spec.sensors):
        spec.delete(own)
    worn = [_loosen(spec, name) for name in boards] if soft_tissue else list(boards)
    for kind in (mujoco.mjtSensor.mjSENS_ACCELEROMETER, mujoco.mjtSensor.mjSENS_GYRO):
        for site in worn:
            sensor = spec.add_sensor(name=f"rig/{kind.value}/{site}")
            sensor.type, sensor.objtype, sensor.objname = kind, mujoco.mjtObj.mjOBJ_SITE, site
    # Prescribed motion: nothing may push back.
    disable = mujoco.mjtDisableBit
    spec.option.disableflags |= int(
        disable.mjDSBL_CONTACT | disable.mjDSBL_CONSTRAINT | disable.mjDSBL_ACTUATION
    )
    model = spec.compile()
    topology = body_from_model(model, "").topology
    id_of = lambda names, kind: np.array(  # noqa: E731
        [mujoco.mj_name2id(model, kind, n) for n in names], int
    )
    joints = id_of(body.topology.joint_names, mujoco.mjtObj.mjOBJ_JOINT)
    widths = np.diff([*body.topology.joint_qpos, body.topology.nq])
    coordinates = np.concatenate(
        [model.jnt_qposadr[j] + np.arange(w) for j, w in zip(joints, widths, strict=True)]
    )
    loose = id_of([f"{_TISSUE}{n}/x" for n in boards] if soft_tissue else [],
                  mujoco.mjtObj.mjOBJ_JOINT)  # fmt: skip
    return Rig(
        model,
        mujoco.MjData(model),
        topology,
        id_of(worn, mujoco.mjtObj.mjOBJ_SITE),
        id_of(sources, mujoco.mjtObj.mjOBJ_SITE),
        id_of([*worn, *anchors], mujoco.mjtObj.mjOBJ_SITE),
        coordinates,
        model.jnt_qposadr[loose][:, None] + np.arange(7) if soft_tissue else np.zeros((0, 7), int),
    )


def _loosen(spec: mujoco.MjSpec, name: str) -> str:
    """Hang a copy of a site on three slides and a ball joint; returns the copy's name."""
    site = spec.site(name)
    joints = mujoco.mjtJoint
    skin = site.parent.add_body(name=_TISSUE + name, pos=site.pos, quat=site.quat)
    loose = [
        skin.add_joint(name=f"{_TISSUE}{name}/{letter}", type=joints.mjJNT_SLIDE, axis=axis)
        for axis, letter in zip(np.eye(3), "xyz", strict=True)
    ]
    loose.append(skin.add_joint(name=f"{_TISSUE}{name}/turn", type=joints.mjJNT_BALL))
    for joint in loose:
        # The model's defaults may limit joints.
        joint.limited, joint.range = mujoco.mjtLimited.mjLIMITED_FALSE, (0.0, 1.0)
    skin.mass, skin.inertia, skin.explicitinertial = _INERT_MASS, np.full(3, _INERT_MASS), True
    skin.add_site(name=_TISSUE + name)
    return _TISSUE + name


def inertial_readings(
    rig: Rig, spline: PoseSpline, time: Float[np.ndarray, "n"]
) -> Float[np.ndarray, "n boards 6"]:
    """Instantaneous specific force [m/s^2] and angular rate [rad/s] of all boards.

    They are C MuJoCo's own accelerometer and gyroscope sensors, evaluated at prescribed position,
    velocity and acceleration.
    """
    model, data = rig.model, rig.data
    q, v, a = spline.evaluate(np.asarray(time))
    out = np.empty((len(q), model.nsensordata))
    for i in range(len(q)):
        data.qpos[:] = q[i]
        data.qvel[:] = v[i]
        data.qacc[:] = a[i]
        mujoco.mj_inverse(model, data)
        out[i] = data.sensordata
    # Sensors stand in order: all accelerometers, then all gyroscopes.
    force, rate = np.split(out.reshape(len(q), -1, 3), 2, axis=1)
    return np.concatenate([force, rate], axis=2)


def site_rotations(
    rig: Rig, spline: PoseSpline, time: Float[np.ndarray, "n"]
) -> Float[np.ndarray, "n boards 3 3"]:
    """R_world_board of all boards."""
    q, _, _ = spline.evaluate(np.asarray(time))
    out = np.empty((len(q), len(rig.board_sites), 3, 3))
    for i, pose in enumerate(q):
        place(rig, pose)
        out[i] = rig.data.site_xmat[rig.board_sites].reshape(-1, 3, 3)
    return out


def place(rig: Rig, q: Float[np.ndarray, "nq"]) -> None:
    """Bring the rig into a pose (positions of sites and shapes only)."""
    rig.data.qpos[:] = q
    mujoco.mj_kinematics(rig.model, rig.data)

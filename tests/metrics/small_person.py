"""A small T-pose body and solutions on it, for the tests of metrics and report."""

from __future__ import annotations

import numpy as np

from mocap_jax.body import Body, load_body
from mocap_jax.recording import Recording, SensorSpec, Setup, Truth
from mocap_jax.solution import Solution, Status
from mocap_jax.trajectory import Trajectory

SENSORS = ("pelvis", "head", "right_upper_arm", "right_forearm", "left_thigh")


def person_xml(scale: float = 1.0) -> str:
    """MJCF of a person in T-pose facing +x: ball joints, a hinge elbow, a hinge knee."""
    s = scale

    def segment(name: str, at: str, joint: str, site: str = "", inner: str = "") -> str:
        carried = f'<site name="{site}"/>' if site else ""
        return (
            f'<body name="{name}" pos="{at}">{joint}<geom size="0.05" mass="1"/>{carried}{inner}'
            "</body>"
        )

    def ball(name: str) -> str:
        return f'<joint name="{name}" type="ball"/>'

    def hinge(name: str, axis: str) -> str:
        return f'<joint name="{name}" type="hinge" axis="{axis}"/>'

    arms, legs = "", ""
    for side, sign in (("Left", 1), ("Right", -1)):
        low = side.lower()
        hand = segment(f"{side}Hand", f"0 {sign * 0.25 * s} 0", ball(f"{low}_wrist"))
        fore = segment(
            f"{side}ForeArm", f"0 {sign * 0.3 * s} 0", hinge(f"{low}_elbow", f"0 0 {sign}"),
            f"{low}_forearm", hand,
        )  # fmt: skip
        arms += segment(
            f"{side}UpperArm", f"0 {sign * 0.2 * s} {0.4 * s}", ball(f"{low}_shoulder"),
            f"{low}_upper_arm", fore,
        )  # fmt: skip
        foot = segment(f"{side}Foot", f"0 0 {-0.4 * s}", ball(f"{low}_ankle"))
        shank = segment(
            f"{side}LowerLeg", f"0 0 {-0.45 * s}", hinge(f"{low}_knee", "0 1 0"), "", foot
        )
        legs += segment(
            f"{side}UpperLeg", f"0 {sign * 0.1 * s} 0", ball(f"{low}_hip"), f"{low}_thigh", shank
        )
    head = segment("Head", f"0 0 {0.5 * s}", ball("neck"), "head")
    return (
        '<mujoco><compiler angle="radian"/><worldbody><body name="Pelvis" pos="0 0 1">'
        '<freejoint name="root"/><geom size="0.1" mass="5"/><site name="pelvis"/>'
        f"{head}{arms}{legs}</body></worldbody></mujoco>"
    )


def person(scale: float = 1.0) -> Body:
    return load_body(person_xml(scale))


def setup(score_from: float = 0.0) -> Setup:
    return Setup(sensors=tuple(SensorSpec(s, s, 100.0) for s in SENSORS), score_from=score_from)


def swing(body: Body, frames: int = 60, seed: int = 0) -> Trajectory:
    """A smooth random motion."""
    rng = np.random.default_rng(seed)
    topology = body.topology
    time = np.arange(frames) / 100.0
    phase, amplitude = rng.uniform(0, 6, topology.nv), rng.uniform(0.1, 0.6, topology.nv)
    curve = amplitude * np.sin(2 * np.pi * 0.8 * time[:, None] + phase)
    return Trajectory(time, moved(body, np.repeat(np.asarray(body.qpos0)[None], frames, 0), curve))


def moved(body: Body, q: np.ndarray, delta: np.ndarray) -> np.ndarray:
    """Poses moved along tangent vectors, by SciPy's rotations."""
    from scipy.spatial.transform import Rotation

    out = np.array(q)
    in_q, in_v = body.topology.scalar_index
    out[:, in_q] += delta[:, in_v]
    for i, j in zip(*body.topology.quat_index, strict=True):
        start = Rotation.from_quat(q[:, i], scalar_first=True)
        out[:, i] = (start * Rotation.from_rotvec(delta[:, j])).as_quat(scalar_first=True)
    return out


def solution(body: Body, trajectory: Trajectory, **changes: object) -> Solution:
    fields: dict = {
        "trajectory": trajectory, "body": body, "status": Status.CONVERGED, "method": "optimise",
        "setup": setup(),
    } | changes  # fmt: skip
    return Solution(**fields)


def recording(trajectory: Trajectory, scale: float = 1.0, score_from: float = 0.0) -> Recording:
    return Recording(
        {}, None, None, {}, None, Truth(trajectory, person_xml(scale)), setup(score_from),
        person_xml(), subject="a person",
    )  # fmt: skip

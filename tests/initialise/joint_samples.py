"""Two segments and their joint in motion, with a sensor on each, simulated by C MuJoCo."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body, load_body
from mocap_jax.motion import Motion
from mocap_jax.recording import Recording
from mocap_jax.simulation import Mounting, SimulationOptions, Suit, simulate
from mocap_jax.simulation.profiles import Profile
from mocap_jax.trajectory import Trajectory

# Not along any axis of any frame; the universal joint's axes are 80 degrees apart.
AXIS = np.array([0.36, 0.48, 0.8])
OTHER = Rotation.from_rotvec(np.deg2rad(80) * np.array([0.8, -0.6, 0.0])).apply(AXIS)
POSITIONS = {"thigh": np.array([0.03, 0.05, -0.22]), "shank": np.array([0.04, -0.02, 0.17])}
TURNS = {
    "thigh": Rotation.from_rotvec([0.5, -1.1, 0.3]),
    "shank": Rotation.from_rotvec([-1.4, 0.2, 0.9]),
}
CENTRE = np.array([0.02, 0.0, -0.42])
"""Of the joint in the thigh."""
_XML = """<mujoco><worldbody><body name="thigh" pos="0 0 1"><freejoint name="root"/>
<geom size=".1"/><body name="shank" pos="0.02 0 -0.42">{joints}<geom size=".1"/></body></body>
</worldbody></mujoco>"""


class Sample(NamedTuple):
    """A recording and what is to be found in it."""

    recording: Recording
    arms: np.ndarray
    """From the sensors to the joint, in their frames (2, 3) [m]."""
    axes: np.ndarray
    """Of the hinge, or the first and second of a universal joint, in the sensors' frames (2, 3)."""
    time: np.ndarray
    relative: Rotation
    """True orientation of the shank's sensor in the thigh's."""


def sample(
    kind: str, *, profile: str | Profile = "paper", seed: int = 0, seconds: float = 20.0,
    root_turns: bool = True, magnetic_field: tuple[float, float, float] | None = None,
) -> Sample:  # fmt: skip
    """Random sines on all degrees of freedom, after a still second."""
    text = lambda axis: " ".join(map(str, axis))  # noqa: E731
    hinge = f'<joint name="flexion" axis="{text(AXIS)}"/>'
    joints = {
        "hinge": hinge,
        "universal": hinge + f'<joint name="twist" axis="{text(OTHER)}"/>',
        "ball": '<joint name="joint" type="ball"/>',
    }
    body = load_body(_XML.format(joints=joints[kind]))
    boards = tuple(
        Mounting(n, n, tuple(POSITIONS[n]), tuple(TURNS[n].as_quat(scalar_first=True)))
        for n in POSITIONS
    )
    motion = Motion(kind, body, _swinging(body, seed, seconds, root_turns))
    recording = simulate(
        motion, profile=profile, seed=seed, suit=Suit(boards),
        options=SimulationOptions(
            rest_s=1.0, inertial_rate_hz=100.0, magnetic_field=magnetic_field
        ),
    )  # fmt: skip
    thigh, shank = TURNS["thigh"].inv(), TURNS["shank"].inv()
    arms = np.stack([thigh.apply(CENTRE - POSITIONS["thigh"]), shank.apply(-POSITIONS["shank"])])
    second = AXIS if kind == "hinge" else OTHER
    truth = recording.truth.trajectory
    return Sample(
        recording, arms, np.stack([thigh.apply(AXIS), shank.apply(second)]),
        np.asarray(truth.time), thigh * _joint(kind, np.asarray(truth.q)[:, 7:]) * TURNS["shank"],
    )  # fmt: skip


def _swinging(body: Body, seed: int, seconds: float, root_turns: bool) -> Trajectory:
    """Coordinates by sums of three sines each; the root's and ball joints' as rotation vectors."""
    rng = np.random.default_rng(seed)
    time = np.arange(int(seconds * 100)) / 100.0
    frequency = rng.uniform(0.2, 1.4, (3, body.nv))
    phase = rng.uniform(0, 6, (3, body.nv))
    amplitude = rng.uniform(0.3, 0.6, (3, body.nv)) / (1 + frequency)
    amplitude[:, :3] *= 0.2
    amplitude[:, 3:6] *= root_turns
    delta = (amplitude * np.sin(2 * np.pi * frequency * time[:, None, None] + phase)).sum(1)
    quat = lambda v: Rotation.from_rotvec(v).as_quat(scalar_first=True)  # noqa: E731
    joint = quat(delta[:, 6:]) if body.nq == 11 else delta[:, 6:]
    q = np.hstack([delta[:, :3] + [0, 0, 1], quat(delta[:, 3:6]), joint])
    return Trajectory(time, q, np.zeros((len(time), body.nv)))


def _joint(kind: str, q: np.ndarray) -> Rotation:
    """Orientation of the shank in the thigh."""
    if kind == "ball":
        return Rotation.from_quat(q, scalar_first=True)
    turn = Rotation.from_rotvec(q[:, :1] * AXIS)
    return turn if kind == "hinge" else turn * Rotation.from_rotvec(q[:, 1:2] * OTHER)

"""A body that sways over one planted foot and swings the other: what holds its free root."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mocap_jax as mj
from mocap_jax.body import Body, load_body
from mocap_jax.estimate.initial_guess import at_rest
from mocap_jax.estimate.whole_sequence import solve_sequence
from mocap_jax.motion import Motion
from mocap_jax.simulation import PROFILES, Mounting, Suit

SECONDS, RATE = 3.0, 60.0
LEG = """<body name="{side}LowerLeg" pos="0 {y} -.4"><joint name="{side}Hip" type="ball"/>
<geom type="capsule" size=".05" fromto="0 0 -.1 0 0 -.4"/>
<body name="{side}Foot" pos="0 0 -.5"><joint name="{side}Ankle" axis="0 1 0"/>
<geom size=".04"/><body name="{side}Toe" pos=".12 0 -.08"><geom size=".02"/></body></body></body>"""


def biped() -> Body:
    legs = "".join(LEG.format(side=s, y=y) for s, y in (("Left", 0.1), ("Right", -0.1)))
    return load_body(
        '<mujoco><worldbody><body name="Pelvis" pos="0 0 1"><freejoint/><geom size=".1"/>'
        f"{legs}</body></worldbody></mujoco>"
    )


def swaying() -> Motion:
    """The left foot stays where it is; the right leg swings to and fro every 1.2 seconds."""
    body = biped()
    top = body.topology
    time = np.arange(round(SECONDS * 120) + 1) / 120.0
    grow = np.clip(time / 0.6, 0, 1) ** 3 * (10 - 15 * np.clip(time / 0.6, 0, 1)
                                             + 6 * np.clip(time / 0.6, 0, 1) ** 2)  # fmt: skip
    wave = lambda size, hz, phase=0.0: size * grow * np.sin(2 * np.pi * hz * time + phase)  # noqa: E731
    hip = Rotation.from_rotvec(np.stack([wave(0.1, 0.5), wave(0.25, 0.7), wave(0.1, 0.4)], 1))
    ankle = Rotation.from_rotvec(np.outer(wave(-0.2, 0.7), [0.0, 1.0, 0.0]))
    right = Rotation.from_rotvec(np.outer(wave(0.7, 1 / 1.2), [0.0, 1.0, 0.0]))
    q = np.tile(np.asarray(body.qpos0), (len(time), 1))
    at = {n: int(top.joint_qpos[j]) for j, n in enumerate(top.joint_names)}
    for name, turn in (("LeftHip", hip), ("RightHip", right)):
        q[:, at[name] : at[name] + 4] = turn.as_quat(scalar_first=True)
    q[:, at["LeftAnkle"]] = wave(-0.2, 0.7)
    # The pelvis is where the planted foot has it.
    pelvis = (hip * ankle).inv()
    foot = np.array([0.0, 0.1, -0.4]) + hip.apply([0.0, 0.0, -0.5])
    q[:, :3] = np.array([0.0, 0.1, 0.1]) - pelvis.apply(foot)
    q[:, 3:7] = pelvis.as_quat(scalar_first=True)
    return Motion("swaying", body, mj.Trajectory(time, q, None), {})


@pytest.fixture(scope="module")
def recording() -> mj.Recording:
    places = {"Pelvis": (0.1, 0.0, 0.0), "LeftLowerLeg": (0.05, 0.0, -0.3),
              "RightLowerLeg": (0.05, 0.0, -0.3)}  # fmt: skip
    suit = Suit(tuple(Mounting(name.lower(), name, place) for name, place in places.items()))
    options = mj.SimulationOptions(
        rest_s=0.5, blend_s=0.2, inertial_rate_hz=RATE, orientations=True
    )
    biased = dataclasses.replace(PROFILES["paper"], accelerometer_bias=0.1)
    return mj.simulate(swaying(), profile=biased, suit=suit, options=options, seed=1)


def solved(recording: mj.Recording, contacts: mj.ContactOptions | None):
    """Root positions less the true ones (t, 3) [m], and what stood behind them."""
    plain = mj.OptimiseOptions(
        kinds="AGO", root="free", covariance=False, chunk=64, contacts=contacts,
        constants=mj.ConstantsOptions(
            gyroscope_bias_sigma=0.0, accelerometer_bias_sigma=0.0, mounting_sigma=0.0,
            offset_sigma=0.0, adapt=False,
        ),
        noise=mj.NoiseOptions(adapt=False),
    )  # fmt: skip
    assert recording.body_xml is not None and recording.truth is not None
    start = at_rest(recording, load_body(recording.body_xml), use_root=False)
    solution, run = solve_sequence(recording, initial=start, options=plain)
    assert solution.status.ok
    true = recording.truth.trajectory
    frames = [np.interp(run.data.time, true.time, true.q[:, i]) for i in range(3)]
    return np.asarray(solution.trajectory.q)[:, :3] - np.stack(frames, axis=1), run


def test_a_planted_foot_holds_the_root(recording: mj.Recording) -> None:
    free, _ = solved(recording, None)
    held, run = solved(recording, mj.ContactOptions())
    drift, kept = (float(np.linalg.norm(x[-1])) for x in (free, held))
    print(f"drift {drift:.3f} m, with contacts {kept:.3f} m")
    assert kept < 0.05 and kept < 0.3 * drift
    standing = run.built.contacts.standing
    names = run.body.topology.body_names
    left = np.array([names[b] == "LeftFoot" for b in run.built.contacts.feet.bodies])
    assert standing[:, left].mean() > 0.9
    # The other foot swings: it stands in the rest hold, and turns round for moments.
    moving = run.data.time > recording.setup.rest.end + 1.0
    assert standing[moving][:, ~left].mean() < 0.1

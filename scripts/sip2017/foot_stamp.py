"""What orientations cannot tell: a foot lifted by the thigh, or by the knee alone.

Both times the lower leg tilts by the same angle, and no board sits on the thigh. The paper shows
a foot stamp (section 5.3, figure 12, second column).
"""

from __future__ import annotations

from pathlib import Path

import jax.numpy as jnp
import matplotlib
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

import mocap_jax as mj
from mocap_jax.metrics.align import align
from mocap_jax.motion import Motion
from mocap_jax.simulation import SUITS, named_suit
from mocap_jax.solution.poses import segment_poses
from sip2017.pose_grid import draw_grid
from sip2017.rows import estimate

matplotlib.use("Agg")
from matplotlib import pyplot as plt

SUIT = "sip6_tnt15"
COLOURS = {"SOP": "#c0392b", "SIP": "#1f6fb4"}
_RATE, _TILT = 120.0, 35.0
# Each movement: when it begins and how long it takes [s], how far the thigh is lifted [deg].
_MOVES = ((0.5, 1.2, 60.0), (2.4, 1.2, 0.0))
_SECONDS = 4.2
_SEGMENT = "RightUpperLeg"


def foot_stamp() -> Motion:
    """The built-in human stands, lifts its right knee with the shank tilted back, and then tilts
    the shank alike with the thigh hanging."""
    body = mj.human()
    time = np.arange(round(_SECONDS * _RATE)) / _RATE
    bumps = [_bump((time - begin) / length) for begin, length, _ in _MOVES]
    thigh = sum(lift * bump for (*_, lift), bump in zip(_MOVES, bumps, strict=True))
    shank = _TILT * (bumps[0] + bumps[1])
    model, q = body.mujoco_model(), np.tile(np.asarray(body.qpos0), (len(time), 1))
    hip = model.joint(_SEGMENT).qposadr[0]
    lifted = Rotation.from_euler("y", -thigh[:, None], degrees=True)
    q[:, hip : hip + 4] = lifted.as_quat(scalar_first=True)
    q[:, model.joint("RightLowerLeg_flexion").qposadr[0]] = np.radians(thigh + shank)
    q[:, model.joint("RightFoot_dorsiflexion").qposadr[0]] = np.radians(0.5 * shank)
    return Motion("foot stamp", body, mj.Trajectory(jnp.asarray(time), jnp.asarray(q)), {})


def _bump(s: np.ndarray) -> np.ndarray:
    """From 0 to 1 and back while s runs from 0 to 1, smoothly."""
    s = np.clip(s, 0.0, 1.0)
    return 64 * (s * (1 - s)) ** 3


def thigh_angle(body: mj.Body, q: np.ndarray) -> Float[np.ndarray, "t"]:
    """How far the right thigh points forward from hanging [deg]."""
    place = segment_poses(body, q)[1]
    at = [body.topology.body_index(n) for n in (_SEGMENT, "RightLowerLeg")]
    along = place[:, at[1]] - place[:, at[0]]
    return np.degrees(np.arctan2(along[:, 0], -along[:, 2]))


def reproduce_foot_stamp(folder: Path, profile: str = "field", seed: int = 0) -> str:
    """Estimate both movements, draw `foot_stamp.png` and `foot_stamp_angle.png`, say the errors."""
    motion = foot_stamp()
    recording = mj.simulate(
        motion, profile=profile, seed=seed, suit=named_suit(SUIT, motion.body),
        options=mj.SimulationOptions(inertial_rate_hz=60, orientations=True),
    )  # fmt: skip
    prior = mj.default_pose_prior()
    found = {row: estimate(row, recording, SUITS[SUIT], prior, seed) for row in COLOURS}
    pairs = {row: align(s, recording) for row, s in found.items()}
    start = recording.setup.score_from
    times = [start + begin + 0.5 * length for begin, length, _ in _MOVES]
    captions = ("thigh lifted", "knee bent alone")
    pictures = [
        draw_grid(
            {row: (s, COLOURS[row]) for row, s in found.items()}, recording, times,
            folder / "foot_stamp.png", turn=-1.45, captions=captions,
        ),
        _curve(pairs, start, folder / "foot_stamp_angle.png"),
    ]  # fmt: skip
    lines = ["Foot stamp: forward angle of the right thigh [deg] at both peaks.", _HEAD]
    first = next(iter(pairs.values()))
    rows = {"truth": (first.time, thigh_angle(first.reference_body, first.reference_q))}
    rows |= {row: (p.time, thigh_angle(p.body, p.q)) for row, p in pairs.items()}
    for row, (time, angle) in rows.items():
        a, b = (float(angle[np.argmin(np.abs(time - t))]) for t in times)
        lines.append(f"{row:<6} {a:14.0f} {b:17.0f}")
    return "\n".join([*lines, *(f"wrote {p}" for p in pictures)])


_HEAD = f"{'':<6} {'thigh lifted':>14} {'knee bent alone':>17}"


def _curve(pairs: dict, start: float, file: Path) -> Path:
    figure, ax = plt.subplots(figsize=(7, 2.8), layout="constrained")
    first = next(iter(pairs.values()))
    truth = thigh_angle(first.reference_body, first.reference_q)
    ax.plot(first.time - start, truth, color="0.6", lw=4, label="truth")
    for row, pair in pairs.items():
        ax.plot(pair.time - start, thigh_angle(pair.body, pair.q), color=COLOURS[row], label=row)
    ax.set_xlabel("time [s]")
    ax.set_ylabel("thigh forward [deg]")
    ax.grid(alpha=0.3)
    ax.legend(frameon=False, fontsize=8)
    figure.savefig(file, dpi=110)
    plt.close(figure)
    return file

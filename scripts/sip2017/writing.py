"""Figure 11: handwriting, recovered from six boards as the path of the wrist on the board.

The estimates' wrists are laid on the true one by what inertial sensors cannot tell: a turn about
the vertical and a shift, those that fit best over the whole writing (least squares, same moments).
No scale, no tilt. The plane is the true board's; errors are split into those along it and off it.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from jaxtyping import Bool, Float

import mocap_jax as mj
from mocap_jax.initialise import declared_pose
from mocap_jax.metrics.align import align
from mocap_jax.motion import Motion
from mocap_jax.simulation import SUITS, named_suit
from mocap_jax.solution.poses import segment_poses
from sip2017 import letters
from sip2017.bodies import subject_body, worn
from sip2017.writing_motion import writing_motion

matplotlib.use("Agg")
from matplotlib import pyplot as plt

SUIT = "sip6_tnt15"
_COLOURS = {"SOP": "#c0392b", "SIP": "#1f6fb4"}
_WRIST = "RightHand"


@dataclass(frozen=True)
class Trace:
    """A wrist's path, at the moments when the pen writes."""

    stroke: Float[np.ndarray, "n"]
    """Number of the stroke."""
    found: Float[np.ndarray, "n 3"]
    """Laid on the true path [m]."""
    true: Float[np.ndarray, "n 3"]
    """Board normal to X [m]."""

    @property
    def along(self) -> float:
        """RMS error along the board [m]."""
        return float(np.sqrt(((self.found - self.true)[:, 1:] ** 2).sum(axis=1).mean()))

    @property
    def off(self) -> float:
        """RMS error off the board [m]."""
        return float(np.sqrt(((self.found - self.true)[:, 0] ** 2).mean()))


def reproduce_writing(
    folder: Path, word: str = "mocap", profile: str = "field", seeds: int = 1
) -> str:
    """Estimate, draw `writing.png`, and say the errors."""
    motion, path = writing_motion(word)
    lines = [HEAD]
    for seed in range(seeds):
        recording = write_on_boards(motion, profile, seed)
        traces = {row: trace(s, recording, path) for row, s in estimates(recording).items()}
        lines += [
            f"{row:<5} seed {seed}   {100 * t.along:6.1f}   {100 * t.off:6.1f}"
            for row, t in traces.items()
        ]
        if seed == 0:
            lines.append(f"wrote {draw(traces, folder / 'writing.png')}")
    return "\n".join(lines)


HEAD = """\
Handwriting (figure 11): RMS error of the wrist's path [cm] while the pen writes, after the turn
about the vertical and the shift that fit best.
               along the board   off it"""


def write_on_boards(motion: Motion, profile: str, seed: int) -> mj.Recording:
    """The recording of six boards."""
    return mj.simulate(
        motion, profile=profile, seed=seed, suit=named_suit(SUIT, motion.body),
        options=mj.SimulationOptions(inertial_rate_hz=60, orientations=True),
    )  # fmt: skip


def estimates(recording: mj.Recording) -> dict[str, mj.Solution]:
    """SOP, and from it SIP as in table 2; but the feet of the one who writes stand.

    Without feet that stand the wrist is known relative to a root that drifts by metres.
    """
    recording = dataclasses.replace(recording, root=None)
    prior = mj.default_pose_prior()
    on, body = worn(recording, subject_body(recording), SUITS[SUIT])
    start = mj.orientation_pass(
        on, body, start=declared_pose(on.setup.rest, body),
        options=mj.OrientationPassOptions(pose_prior=prior, warm_start=True), throw=True,
    )  # fmt: skip
    options = mj.sparse_options(prior, contacts=True)
    options = dataclasses.replace(options, root="free", covariance=False)
    return {"SOP": start, "SIP": mj.optimise(on, body, initial=start, options=options, throw=True)}


def trace(solution: mj.Solution, recording: mj.Recording, path: letters.Path) -> Trace:
    """The wrist of an estimate, laid on the true one."""
    pair = align(solution, recording)
    at = np.round((pair.time - recording.setup.score_from) * letters.RATE).astype(int)
    stroke = path.stroke[np.clip(at, 0, len(path.stroke) - 1)]
    down: Bool[np.ndarray, "t"] = stroke >= 0
    found = _wrist(pair.body, pair.q)[down]
    true = _wrist(pair.reference_body, pair.reference_q)[down]
    return Trace(stroke[down], laid_on(found, true), true)


def laid_on(found: Float[np.ndarray, "n 3"], true: Float[np.ndarray, "n 3"]) -> np.ndarray:
    """A path turned about the vertical and shifted so that it fits another best."""
    middle = true.mean(axis=0)
    a, b = (found - found.mean(axis=0))[:, :2], (true - middle)[:, :2]
    turn = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return (found - found.mean(axis=0)) @ R.T + middle


def _wrist(body: mj.Body, q: np.ndarray) -> Float[np.ndarray, "t 3"]:
    return segment_poses(body, q)[1][:, body.topology.body_index(_WRIST)]


def draw(traces: dict[str, Trace], file: Path) -> Path:
    """The true writing above those of the estimates, on the board."""
    any_trace = next(iter(traces.values()))
    panels = {"true path of the wrist": (any_trace.true, "0.25", any_trace.stroke)} | {
        f"{row}: {100 * t.along:.1f} cm RMS": (t.found, _COLOURS[row], t.stroke)
        for row, t in traces.items()
    }
    figure, axes = plt.subplots(
        1, len(panels), figsize=(11, 3.4), sharex=True, sharey=True, layout="constrained"
    )
    middle = any_trace.true.mean(axis=0)
    for ax, (title, (points, colour, stroke)) in zip(axes, panels.items(), strict=True):
        for cloud, shade, width in ((any_trace.true, "0.85", 4.0), (points, colour, 1.8)):
            for k in np.unique(stroke):
                across, up = -(cloud - middle)[stroke == k, 1], (cloud - middle)[stroke == k, 2]
                ax.plot(100 * across, 100 * up, color=shade, lw=width, solid_capstyle="round")
        ax.set_title(title, fontsize=10)
        ax.set_aspect("equal")
        ax.set_xlabel("[cm]")
        ax.grid(alpha=0.25)
    axes[0].set_ylabel("[cm]")
    figure.savefig(file, dpi=110)
    plt.close(figure)
    return file

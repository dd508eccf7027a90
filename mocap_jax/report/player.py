"""Motions as data for the page's player: a few points a frame, packed as small integers."""

from __future__ import annotations

import base64

import numpy as np

from mocap_jax.body import Body
from mocap_jax.metrics.align import interpolate, truth_of
from mocap_jax.recording import Recording
from mocap_jax.report.stick import bones, facing
from mocap_jax.report.style import TRUTH
from mocap_jax.solution import Solution
from mocap_jax.solution.anatomy import anatomical_frames
from mocap_jax.solution.poses import root_segment, segment_poses

# Frames a second that are kept, and at most how many in all.
_RATE_HZ, _MOST = 25.0, 450
_HEAD_RADIUS = 0.105


def player_data(
    solutions: dict[str, Solution], colours: dict[str, str], recording: Recording | None
) -> dict[str, object]:
    """What `player.js` draws: times, and for every figure its strokes and their points.

    The truth, where it is known, comes first and is marked `truth`: it is drawn as an outline over
    the estimates. Points are little-endian 16-bit integers in millimetres from the first root
    position on the ground, as base64.
    """
    first = next(iter(solutions.values()))
    time = np.asarray(first.trajectory.time)
    count = int(np.clip((time[-1] - time[0]) * _RATE_HZ + 1, 2, _MOST))
    shown = np.linspace(time[0], time[-1], count)
    figures, origin = [], None
    moving: list[tuple[str, Body, np.ndarray, str]] = []
    known = recording is not None and recording.truth is not None
    if recording is not None and known:
        body, trajectory = truth_of(recording)
        moving.append(("Truth", body, interpolate(body, trajectory, shown), TRUTH))
    for name, s in solutions.items():
        moving.append((name, s.body, interpolate(s.body, s.trajectory, shown), colours[name]))
    heading = 0.0
    for i, (name, body, q, colour) in enumerate(moving):
        R, p = segment_poses(body, q)
        if origin is None:
            origin = p[0, root_segment(body.topology)] * [1.0, 1.0, 0.0]
            heading = facing(body, R)
        truth = known and i == 0
        figures.append(
            {"name": name, "colour": colour, "truth": truth, **_figure(body, R, p, origin)}
        )
    return {
        "time": [round(float(t), 3) for t in shown],
        "heading": round(heading, 3),
        "figures": figures,
    }


def _figure(body: Body, R: np.ndarray, p: np.ndarray, origin: np.ndarray) -> dict[str, object]:
    frames = anatomical_frames(body)
    shapes = [bones(body, R[k], p[k], frames) for k in range(len(R))]
    every = np.stack([np.concatenate([s.start, s.end, s.heads]) for s in shapes]) - origin
    kept, place = _without_repeats(every)
    root = p[:, [root_segment(body.topology)]] - origin
    millimetres = np.rint(1000 * np.concatenate([root, every[:, kept]], axis=1))
    packed = np.clip(millimetres, -32767, 32767).astype("<i2")
    n = len(shapes[0].start)
    # Place 0 is the root.
    strokes = [
        [int(place[i]) + 1, int(place[n + i]) + 1, round(float(w), 3)]
        for i, w in enumerate(shapes[0].width)
    ]
    return {
        "points": base64.b64encode(packed.tobytes()).decode("ascii"),
        "count": int(packed.shape[1]),
        "strokes": strokes,
        "heads": [[int(i) + 1, _HEAD_RADIUS] for i in place[2 * n :]],
    }


def _without_repeats(points: np.ndarray) -> tuple[list[int], np.ndarray]:
    """Points (frames, n, 3) that differ: which are kept, and where each one stands among them."""
    kept: list[int] = []
    place = np.zeros(points.shape[1], int)
    for i in range(points.shape[1]):
        same = [k for k, j in enumerate(kept) if np.abs(points[:, i] - points[:, j]).max() < 5e-4]
        if not same:
            kept.append(i)
        place[i] = same[0] if same else len(kept) - 1
    return kept, place

"""Drawings of a body: limbs as rounded strokes, seen from a chosen side without perspective."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle

from mocap_jax.body import Body
from mocap_jax.metrics.joint_centres import joint_centres
from mocap_jax.report.style import ESTIMATE
from mocap_jax.solution.anatomy import anatomical_frames
from mocap_jax.solution.poses import root_segment, segment_poses

# Stroke width of a limb towards a segment [m], by the end of the segment's name.
_WIDTH = {
    "L5": 0.20, "L3": 0.21, "T12": 0.22, "T8": 0.24, "Neck": 0.10, "Head": 0.09, "Shoulder": 0.10,
    "UpperArm": 0.09, "ForeArm": 0.085, "Hand": 0.07, "UpperLeg": 0.13, "LowerLeg": 0.13,
    "Foot": 0.09, "Toe": 0.07,
}  # fmt: skip
_THIN = 0.05
_HEAD_RADIUS = 0.105
_POINTS_PER_INCH = 72.0


@dataclass(frozen=True)
class Bones:
    """Line segments of a body in the world, one pose."""

    start: Float[np.ndarray, "n 3"]
    end: Float[np.ndarray, "n 3"]
    width: Float[np.ndarray, "n"]
    """Stroke width [m]."""
    heads: Float[np.ndarray, "k 3"]
    """Centres of heads."""


def bones(
    body: Body,
    R: Float[np.ndarray, "nbody 3 3"],
    p: Float[np.ndarray, "nbody 3"],
    anatomical: Float[np.ndarray, "nbody 3 3"],
) -> Bones:
    """Line segments from every joint to the next, and stubs for the last segment of each limb.

    Args:
        body: the body.
        R: world rotations of its segments.
        p: their world positions [m].
        anatomical: `anatomical_frames(body)`; tells which way feet point.
    """
    topology = body.topology
    centre = joint_centres(body, R[None], p[None])[0]
    parent = np.array(topology.body_parent)
    inner = [b for b in range(1, topology.nbody) if parent[b] != 0]
    start, end = [centre[parent[b]] for b in inner], [centre[b] for b in inner]
    # The stroke that leads to a segment belongs to its parent.
    width = [_stroke_width(topology.body_names[parent[b]]) for b in inner]
    heads = []
    for b in sorted(set(range(1, topology.nbody)) - set(parent.tolist())):
        name = topology.body_names[b]
        along, length = _stub_direction(body, R, anatomical, b)
        if name == "Head":
            heads.append(centre[b] + 0.12 * along)
            continue
        start.append(centre[b])
        end.append(centre[b] + along * length)
        width.append(_stroke_width(name))
    return Bones(
        np.array(start).reshape(-1, 3), np.array(end).reshape(-1, 3), np.array(width),
        np.array(heads).reshape(-1, 3),
    )  # fmt: skip


def _stroke_width(name: str) -> float:
    for part, width in _WIDTH.items():
        if name == part or name in (f"Left{part}", f"Right{part}"):
            return width
    return 0.2 if name == "Pelvis" else _THIN


def _stub_direction(
    body: Body, R: np.ndarray, anatomical: np.ndarray, b: int
) -> tuple[np.ndarray, float]:
    """World direction and length [m] of a segment that ends a limb."""
    parent = body.topology.body_parent[b]
    # The offset from the parent at rest, carried by the segment itself.
    offset = np.asarray(body.body_pos)[b]
    length = float(np.linalg.norm(offset))
    name = body.topology.body_names[b]
    if parent == 0 or length < 1e-3:
        return R[b] @ np.array([0.0, 0.0, 1.0]), 0.1
    if name.endswith(("Toe", "Foot")):
        forward = (R[b] @ anatomical[b])[:, 0]
        return forward, 0.05 if name.endswith("Toe") else 0.17
    return R[parent] @ offset / length, float(np.clip(0.6 * length, 0.03, 0.12))


@dataclass(frozen=True)
class View:
    """A parallel projection: what is right, up and towards the viewer, in the world."""

    right: Float[np.ndarray, "3"]
    up: Float[np.ndarray, "3"]
    towards: Float[np.ndarray, "3"]

    def flat(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
        """Picture coordinates [m]."""
        return np.stack([points @ self.right, points @ self.up], axis=-1)


def view_from(heading: float, turn: float = 0.7, tilt: float = 0.12) -> View:
    """View of a person who faces `heading` [rad in the ground plane], from the front to a side.

    Args:
        heading: direction the person faces.
        turn: angle of the viewer from straight ahead [rad].
        tilt: height of the viewer as an angle [rad].
    """
    angle = heading + turn
    level = np.array([np.cos(angle), np.sin(angle), 0.0])
    towards = np.cos(tilt) * level + np.array([0.0, 0.0, np.sin(tilt)])
    right = np.array([-np.sin(angle), np.cos(angle), 0.0])
    return View(right, np.cross(towards, right), towards)


def facing(body: Body, R: Float[np.ndarray, "t nbody 3 3"]) -> float:
    """Direction the root faces in the ground plane [rad], in the mean over frames."""
    root = root_segment(body.topology)
    forward = (R[:, root] @ anatomical_frames(body)[root])[:, :, 0].mean(axis=0)
    return float(np.arctan2(forward[1], forward[0]))


def plot_body(
    axes: Axes,
    body: Body,
    q: Float[np.ndarray, "nq"],
    *,
    view: View | None = None,
    at: tuple[float, float] = (0.0, 0.0),
    colour: str = ESTIMATE,
    alpha: float = 1.0,
    outline: bool = True,
) -> None:
    """Draw a body at one pose.

    Args:
        axes: equal scales, limits set, figure of its final size (strokes are drawn to scale).
        body: the body.
        q: pose.
        view: projection; default from the front and to one side.
        at: where in the picture the root's place on the ground comes [m].
        colour: of the limbs; nearer ones are lighter.
        alpha: opacity.
        outline: a thin rim that separates limbs in front of each other.
    """
    R, p = segment_poses(body, np.asarray(q)[None])
    view = view or view_from(facing(body, R))
    shape = bones(body, R[0], p[0], anatomical_frames(body))
    root = p[0, root_segment(body.topology)]
    draw_bones(axes, shape, root, view, at, colour, alpha, outline)


def draw_bones(
    axes: Axes,
    shape: Bones,
    root: np.ndarray,
    view: View,
    at: tuple[float, float],
    colour: str,
    alpha: float,
    outline: bool,
) -> None:
    """Draw line segments as rounded strokes, far ones first (arguments as of `plot_body`)."""
    ground = np.array([root[0], root[1], 0.0])
    shift = np.array(at) - view.flat(ground[None])[0]
    start, end = view.flat(shape.start) + shift, view.flat(shape.end) + shift
    depth = 0.5 * (shape.start + shape.end) @ view.towards
    order = np.argsort(depth)
    near = (depth - depth.min()) / max(float(np.ptp(depth)), 1e-9)
    scale = _points_per_metre(axes)
    rim = 1.6 if outline else 0.0
    for k in order:
        layer = (10 if outline else 5) + near[k]
        line = [np.stack([start[k], end[k]])]
        points = shape.width[k] * scale
        if outline:
            axes.add_collection(LineCollection(
                line, colors=["white"], linewidths=[points + rim], capstyle="round", zorder=layer,
            ), autolim=False)  # fmt: skip
        axes.add_collection(LineCollection(
            line, colors=[_lighter(colour, 0.35 * near[k])], linewidths=[points], alpha=alpha,
            capstyle="round", zorder=layer + 1e-4,
        ), autolim=False)  # fmt: skip
    for centre in view.flat(shape.heads) + shift:
        axes.add_patch(Circle(
            (centre[0], centre[1]), _HEAD_RADIUS, facecolor=_lighter(colour, 0.2), alpha=alpha,
            edgecolor="white" if outline else "none", linewidth=0.8,
            zorder=12 if outline else 7,
        ))  # fmt: skip


def draw_lines(
    axes: Axes, shape: Bones, root: np.ndarray, view: View, at: tuple[float, float], colour: str
) -> None:
    """Draw thin lines along the limbs over everything: they show where a hidden body is."""
    ground = np.array([root[0], root[1], 0.0])
    shift = np.array(at) - view.flat(ground[None])[0]
    lines = np.stack([view.flat(shape.start) + shift, view.flat(shape.end) + shift], axis=1)
    axes.add_collection(
        LineCollection(list(lines), colors=[colour], linewidths=[0.9], capstyle="round", zorder=20),
        autolim=False,
    )


def _lighter(colour: str, amount: float) -> tuple[float, float, float]:
    r, g, b = (c + (1.0 - c) * amount for c in to_rgb(colour))
    return r, g, b


def _points_per_metre(axes: Axes) -> float:
    box = axes.get_window_extent()
    low, high = axes.get_xlim()
    figure = axes.get_figure()
    dpi = figure.dpi if figure is not None else 100.0
    return float(box.width / dpi * _POINTS_PER_INCH / (high - low))

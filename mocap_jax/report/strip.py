"""A motion as a row of poses, and the shapes that strips and animations draw."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mocap_jax.body import Body
from mocap_jax.metrics.align import align
from mocap_jax.recording import Recording
from mocap_jax.report.stick import Bones, View, bones, draw_bones, draw_lines, facing, view_from
from mocap_jax.report.style import ESTIMATE, INK, MUTED, TRUTH
from mocap_jax.solution import Solution
from mocap_jax.solution.anatomy import anatomical_frames
from mocap_jax.solution.poses import root_segment, segment_poses


def motion_strip(
    solution: Solution,
    reference: Recording | Solution | None = None,
    *,
    poses: int = 8,
    colour: str = ESTIMATE,
    width: float = 10.0,
) -> Figure:
    """A row of poses evenly spaced in time: the estimate in colour, the reference grey behind it.

    Args:
        solution: the estimate.
        reference: a recording with truth, or another solution; None draws the estimate alone.
        poses: how many.
        colour: of the estimate.
        width: of the figure [inch].
    """
    time, shapes, ghosts, roots = shapes_over(solution, reference, poses)
    view = view_from_front(solution)
    low, high = vertical_extent(shapes, roots, view)
    cell = max(0.62 * (high - low), 0.9 * widest(shapes, roots, view))
    axes, figure = _strip_axes(cell * len(shapes), low, high, width)
    for k, shape in enumerate(shapes):
        place = (cell * (k + 0.5), 0.0)
        if ghosts:
            draw_bones(axes, ghosts[k], roots[k], view, place, TRUTH, 1.0, outline=False)
        draw_bones(axes, shape, roots[k], view, place, colour, 0.9, outline=True)
        if ghosts:
            draw_lines(axes, shape, roots[k], view, place, "white")
            draw_lines(axes, ghosts[k], roots[k], view, place, INK)
        axes.text(place[0], low, f"{time[k]:.1f} s", ha="center", va="top", color=MUTED, size=9)
    return figure


def view_from_front(solution: Solution) -> View:
    """View of a solution's person, from the front and to one side, fixed over the motion."""
    q = np.asarray(solution.trajectory.q)
    some = q[np.linspace(0, len(q) - 1, min(len(q), 40)).astype(int)]
    return view_from(facing(solution.body, segment_poses(solution.body, some)[0]))


def shapes_over(
    solution: Solution, reference: Recording | Solution | None, poses: int
) -> tuple[np.ndarray, list[Bones], list[Bones], np.ndarray]:
    """Evenly spaced moments: times, the estimate's bones, the reference's, and root positions."""
    time, q, reference_body, q_true = _frames_to_show(solution, reference, poses)
    R, p = segment_poses(solution.body, q)
    frames = anatomical_frames(solution.body)
    shapes = [bones(solution.body, R[k], p[k], frames) for k in range(len(q))]
    roots = p[:, root_segment(solution.body.topology)]
    return time, shapes, _ghosts(reference_body, q_true, roots), roots


def _ghosts(body: Body | None, q: np.ndarray | None, roots: np.ndarray) -> list[Bones]:
    """The reference's poses, each moved onto the estimate's root: they show pose, not drift."""
    if body is None or q is None:
        return []
    R, p = segment_poses(body, q)
    there = p[:, [root_segment(body.topology)]]
    moved, frames = p + (roots[:, None] - there), anatomical_frames(body)
    return [bones(body, R[k], moved[k], frames) for k in range(len(q))]


def _frames_to_show(
    solution: Solution, reference: Recording | Solution | None, poses: int
) -> tuple[np.ndarray, np.ndarray, Body | None, np.ndarray | None]:
    """Times, poses of the estimate, body and poses of the reference (None without one)."""
    if reference is not None:
        pair = align(solution, reference)
        chosen = np.linspace(0, len(pair.time) - 1, min(poses, len(pair.time))).astype(int)
        return pair.time[chosen], pair.q[chosen], pair.reference_body, pair.reference_q[chosen]
    time, q = np.asarray(solution.trajectory.time), np.asarray(solution.trajectory.q)
    inside = np.flatnonzero(time >= min(solution.setup.score_from, time[-1]))
    chosen = inside[np.linspace(0, len(inside) - 1, min(poses, len(inside))).astype(int)]
    return time[chosen], q[chosen], None, None


def _relative(shape: Bones, root: np.ndarray, view: View) -> np.ndarray:
    ground = np.array([root[0], root[1], 0.0])
    points = np.concatenate([shape.start, shape.end, shape.heads])
    return view.flat(points) - view.flat(ground[None])


def vertical_extent(shapes: list[Bones], roots: np.ndarray, view: View) -> tuple[float, float]:
    """Lowest and highest picture coordinate [m] of all shapes, with a margin."""
    heights = [_relative(s, r, view)[:, 1] for s, r in zip(shapes, roots, strict=True)]
    return min(h.min() for h in heights) - 0.12, max(h.max() for h in heights) + 0.16


def widest(shapes: list[Bones], roots: np.ndarray, view: View) -> float:
    """Width [m] that holds every shape about its root's place, with a margin."""
    across = [_relative(s, r, view)[:, 0] for s, r in zip(shapes, roots, strict=True)]
    return 2 * max(float(np.abs(x).max()) for x in across) + 0.1


def _strip_axes(length: float, low: float, high: float, width: float) -> tuple[Axes, Figure]:
    # Room for the times, whatever the scale: a root that drifts makes the picture high.
    bottom = low - 0.08 * (high - low)
    figure = Figure(figsize=(width, width * (high - bottom) / length))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, length)
    axes.set_ylim(bottom, high)
    axes.set_axis_off()
    axes.axhline(low + 0.04, color=INK, linewidth=0.6, alpha=0.25, zorder=0)
    return axes, figure

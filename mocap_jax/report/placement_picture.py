"""The picture of a placement study: the body with its sensors, and error against their number."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mocap_jax.body import Body, site_frames
from mocap_jax.placement import Placement, PlacementStudy
from mocap_jax.report.stick import facing, plot_body, view_from
from mocap_jax.report.style import INK, METHOD_COLOURS, MUTED, RC, TRUTH, plain_name, quiet_grid
from mocap_jax.simulation import mount
from mocap_jax.solution.poses import root_segment, segment_poses

_SENSOR = METHOD_COLOURS[1]
# Views from in front and from behind: turn of the viewer from straight ahead [rad].
_VIEWS = (("from the front", 0.35), ("from behind", np.pi + 0.35))
_OF = {"cm": "joint centres", "deg": "orientations"}
_WIDTH, _HEIGHT, _SHIFT = 1.5, 2.05, 0.08


def placement_figure(study: PlacementStudy, placement: Placement | None = None) -> Figure:
    """Body with sensors from two sides, trade-off curve, expected error by joint.

    Args:
        study: whose curve is drawn.
        placement: the one drawn; default the best.
    """
    placement = placement or study.best
    with rc_context(RC):
        figure = Figure(figsize=(11.5, 4.6), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(1, 4, width_ratios=(1, 1, 1.3, 1.3))
        for panel, (title, _) in zip(axes[:2], _VIEWS, strict=True):
            _limits(panel, title)
        figure.draw_without_rendering()  # Strokes are drawn to scale: sizes must be final.
        for panel, (_, turn) in zip(axes[:2], _VIEWS, strict=True):
            _body(panel, study.body, placement, turn)
        _curve(axes[2], study, len(placement.segments))
        _joints(axes[3], study, placement)
    return figure


def write_placement_picture(path: str | os.PathLike[str], study: PlacementStudy) -> None:
    """Write the picture as PNG, SVG or PDF by suffix, whole or not at all."""
    file = Path(path)
    part = file.with_name(f".{file.stem}.part{file.suffix}")
    try:
        with rc_context(RC):
            placement_figure(study).savefig(part, dpi=130)
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)


def _limits(axes: Axes, title: str) -> None:
    axes.set(xlim=(-_WIDTH / 2, _WIDTH / 2), ylim=(-_SHIFT, _HEIGHT - _SHIFT), aspect="equal")
    axes.set_title(title)
    axes.axis("off")


def _body(axes: Axes, body: Body, placement: Placement, turn: float) -> None:
    q = np.asarray(body.qpos0)
    R, p = segment_poses(body, q[None])
    view = view_from(facing(body, R), turn)
    plot_body(axes, body, q, view=view, colour=TRUTH)
    points, outward = sensor_frames(body, placement)
    root = p[0, root_segment(body.topology)]
    flat = view.flat(points) - view.flat(np.array([[root[0], root[1], 0.0]]))[0]
    hidden = outward @ view.towards < 0
    axes.scatter(
        flat[~hidden, 0], flat[~hidden, 1], s=42, color=_SENSOR, edgecolor="white", zorder=30
    )
    axes.scatter(
        flat[hidden, 0], flat[hidden, 1], s=42, facecolor="none", edgecolor=_SENSOR, zorder=30
    )
    for at, mounting in zip(flat, placement.suit.boards, strict=True):
        left = at[0] < 0
        axes.annotate(
            plain_name(mounting.name), at, (-6 if left else 6, 0), textcoords="offset points",
            ha="right" if left else "left", va="center", fontsize=6.5, color=INK, zorder=31,
        )  # fmt: skip


def sensor_frames(
    body: Body, placement: Placement
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """World positions of the sensors in the reference pose [m], and directions off the skin."""
    worn = mount(body, placement.suit)
    f = site_frames(worn, worn.qpos0)
    index = [worn.site_index(b.name) for b in placement.suit.boards]
    return np.asarray(f.position)[index], np.asarray(f.rotation)[index][:, :, 2]


def _curve(axes: Axes, study: PlacementStudy, chosen: int) -> None:
    count = [c.sensors for c in study.curve]
    error = [c.mean(study.options.quantity) for c in study.curve]
    axes.plot(count, error, marker="o", color=METHOD_COLOURS[0])
    at = count.index(chosen) if chosen in count else None
    if at is not None:
        axes.plot(count[at], error[at], marker="o", markersize=9, color=_SENSOR)
    axes.set(
        xlabel="number of sensors", ylabel=f"expected error of {_OF[study.unit]} [{study.unit}]",
        ylim=(0, None), xticks=count, title="Error by number",
    )  # fmt: skip
    quiet_grid(axes)


def _joints(axes: Axes, study: PlacementStudy, placement: Placement) -> None:
    expected = placement.expected(study.options.quantity)
    names = list(expected)
    rows = np.arange(len(names))
    axes.barh(rows, list(expected.values()), color=METHOD_COLOURS[0], height=0.7)
    axes.set_yticks(rows, names, fontsize=6.5, color=MUTED)
    axes.invert_yaxis()
    axes.set(xlabel=f"expected error [{study.unit}]", title="Error by joint")
    axes.grid(axis="y", visible=False)

"""`write_animation`: an estimate over the truth as a moving picture."""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from mocap_jax.errors import InputError
from mocap_jax.io.atomic import atomic_file
from mocap_jax.recording import Recording
from mocap_jax.report.stick import draw_bones, draw_lines
from mocap_jax.report.strip import shapes_over, vertical_extent, view_from_front, widest
from mocap_jax.report.style import ESTIMATE, INK, MUTED, TRUTH
from mocap_jax.solution import Solution

_FORMATS = {".gif": "GIF", ".webp": "WEBP", ".png": "PNG"}


def write_animation(
    path: str | os.PathLike[str],
    solution: Solution,
    reference: Recording | Solution | None = None,
    *,
    rate_hz: float = 12.5,
    width: int = 320,
    colour: str = ESTIMATE,
) -> None:
    """Write a moving picture: the estimate in colour, the reference grey behind it.

    Thin lines along the limbs, dark for the reference, show it where the estimate hides it. Both
    stand on the estimate's root, seen from the front and to one side; no display is needed.

    Args:
        path: `.gif`, `.webp` or `.png` (animated).
        solution: the estimate.
        reference: a recording with truth, or another solution; None draws the estimate alone.
        rate_hz: pictures a second; the motion keeps its speed.
        width: of the picture [pixels].
        colour: of the estimate.

    Raises:
        InputError: unknown suffix, rate or width not above 0, or the file cannot be written.
    """
    kind = _FORMATS.get(Path(path).suffix.lower())
    if kind is None:
        raise InputError(f"{path}: unknown suffix; valid: {', '.join(_FORMATS)}")
    if not (rate_hz > 0 and width > 0):
        raise InputError(f"rate_hz {rate_hz:g} and width {width:g} must be above 0")
    pictures = _pictures(solution, reference, rate_hz, width, colour)
    options = {"lossless": False, "quality": 70} if kind == "WEBP" else {}
    buffer = io.BytesIO()
    pictures[0].save(
        buffer, kind, save_all=True, append_images=pictures[1:], duration=round(1000 / rate_hz),
        loop=0, **options,
    )  # fmt: skip
    with atomic_file(path) as stream:
        stream.write(buffer.getvalue())


def _pictures(
    solution: Solution,
    reference: Recording | Solution | None,
    rate_hz: float,
    width: int,
    colour: str,
) -> list[Image.Image]:
    span = solution.trajectory.time
    count = max(int((float(span[-1]) - float(span[0])) * rate_hz), 2)
    time, shapes, ghosts, roots = shapes_over(solution, reference, count)
    view = view_from_front(solution)
    low, high = vertical_extent(shapes, roots, view)
    across = max(widest(shapes, roots, view), 0.75 * (high - low))
    height = round(width * (high - low + 0.12) / across)
    figure = Figure(figsize=(width / 100, height / 100), dpi=100)
    canvas = FigureCanvasAgg(figure)
    pictures = []
    for k, shape in enumerate(shapes):
        figure.clear()
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(-across / 2, across / 2),
                               ylim=(low - 0.12, high))  # fmt: skip
        axes.set_axis_off()
        if ghosts:
            draw_bones(axes, ghosts[k], roots[k], view, (0.0, 0.0), TRUTH, 1.0, outline=False)
        draw_bones(axes, shape, roots[k], view, (0.0, 0.0), colour, 0.9, outline=True)
        if ghosts:
            draw_lines(axes, shape, roots[k], view, (0.0, 0.0), "white")
            draw_lines(axes, ghosts[k], roots[k], view, (0.0, 0.0), INK)
        axes.text(0.0, low, f"{time[k]:.1f} s", ha="center", va="top", color=MUTED, size=9)
        canvas.draw()
        pictures.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy()))
    return pictures

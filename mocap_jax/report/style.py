"""Colours and fonts of the report's figures, and their embedding in the page."""

from __future__ import annotations

import base64
import io

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

INK, MUTED, RULE = "#1f2933", "#6b7785", "#d9dee4"
TRUTH = "#9aa5b1"
# What cannot be measured, and is no fault.
EXCLUDED = "#d3d8de"
ESTIMATE = "#2f6fde"
METHOD_COLOURS = ("#2f6fde", "#e07b1f", "#2a9d74", "#a4469f", "#7a6a53", "#c23b4b")

RC = {
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.edgecolor": RULE,
    "axes.labelcolor": MUTED,
    "axes.titlecolor": INK,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#eceff2",
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "text.color": INK,
    "legend.frameon": False,
    "svg.hashsalt": "mocap_jax",
}


def colours(names: list[str]) -> dict[str, str]:
    """A colour for each method, in order."""
    return {n: METHOD_COLOURS[i % len(METHOD_COLOURS)] for i, n in enumerate(names)}


def embedded(figure: Figure) -> str:
    """The figure as a `data:` address of an SVG picture."""
    buffer = io.BytesIO()
    with rc_context(RC):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def embedded_raster(figure: Figure, dpi: float = 150.0) -> str:
    """The same as a PNG picture of 256 colours: smaller where there are very many shapes."""
    with rc_context(RC):
        figure.set_dpi(dpi)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    buffer = io.BytesIO()
    picture.quantize(256, Image.Quantize.MEDIANCUT).save(buffer, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def plain_name(name: str) -> str:
    """A sensor's name for a figure; a dollar sign would start a formula."""
    return name.replace("_", " ").replace("$", r"\$")


def quiet_grid(axes: Axes) -> None:
    """Horizontal lines only, behind the data."""
    axes.grid(axis="x", visible=False)
    axes.set_axisbelow(True)

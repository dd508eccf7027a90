"""The picture beside figure 7 of the paper: the left shoulder with and without distances."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vlasic2007.cells import METHODS as NAMES
from vlasic2007.treadmill import COMBINATIONS, METHODS, Shoulder

_LABELS = {"A+G+D": "with distances", "A+G": "without"}
_ANGLE = 2  # Internal rotation: about the hanging arm, the turn that gravity does not show.
_DPI = 95


def draw(series: dict[tuple[str, str], Shoulder], body, target: Path) -> Path:
    """Write the picture.

    Args:
        series: by method and combination.
        body: to draw the poses on.
        target: the .png file.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from mocap_jax.report.style import RC

    with rc_context(RC):
        figure = Figure(figsize=(9.5, 4.6))
        grid = figure.add_gridspec(
            len(METHODS), 1, left=0.415, right=0.985, top=0.87, bottom=0.105, hspace=0.30
        )
        panels = [figure.add_subplot(cell) for cell in grid]
        for axes, method in zip(panels, METHODS, strict=True):
            _curves(axes, method, series)
            axes.label_outer()
        panels[-1].set_xlabel("time [s]")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper right", ncols=3, bbox_to_anchor=(0.985, 1.0))
        _frames(figure, series, body)
        figure.savefig(target, dpi=_DPI)
    return target


def _colours() -> dict[str, str]:
    from mocap_jax.report.style import METHOD_COLOURS

    return dict(zip(COMBINATIONS, METHOD_COLOURS, strict=False))


def _curves(axes, method: str, series: dict[tuple[str, str], Shoulder]) -> None:
    from mocap_jax.report.style import INK, quiet_grid

    first = series[method, COMBINATIONS[0]]
    name = first.names[_ANGLE].replace("_", " ")
    axes.plot(first.time, first.true_angles[:, _ANGLE], color=INK, linewidth=1.2, label="truth")
    for combination in COMBINATIONS:
        one = series[method, combination]
        axes.plot(one.time, one.angles[:, _ANGLE], color=_colours()[combination], linewidth=0.9,
                  label=f"{combination}: {_LABELS[combination]}")  # fmt: skip
    axes.set_title(f"{NAMES[method]}: left shoulder, {name} [deg]")
    axes.set_xlim(first.time[0], first.time[-1])
    quiet_grid(axes)


def _frames(figure, series: dict[tuple[str, str], Shoulder], body) -> None:
    """One frame of the first method: the truth in grey behind each estimate."""
    from mocap_jax.report import plot_body
    from mocap_jax.report.stick import view_from
    from mocap_jax.report.style import MUTED, TRUTH

    worst = series[METHODS[0], COMBINATIONS[-1]]
    k = int(np.argmax(worst.error_angle))
    width, height = 2.1, 2.15
    box = figure.add_axes((0.0, 0.06, 0.36, 0.36 * 9.5 / 4.6 * height / width))
    box.set(xlim=(0.0, width), ylim=(-0.25, height - 0.25))
    box.set_axis_off()
    view = view_from(0.0, turn=0.55)
    for i, combination in enumerate(COMBINATIONS):
        at = (width * (0.21 + 0.42 * i), 0.0)
        one = series[METHODS[0], combination]
        plot_body(box, body, one.true_q[k], view=view, at=at, colour=TRUTH, outline=False)
        plot_body(box, body, one.q[k], view=view, at=at, colour=_colours()[combination], alpha=0.9)
        box.text(at[0], -0.2, _LABELS[combination], ha="center", color=MUTED)
    figure.text(0.015, 0.955, f"{NAMES[METHODS[0]]}, at {worst.time[k]:.0f} s (truth in grey)",
                weight="bold", size=10)  # fmt: skip

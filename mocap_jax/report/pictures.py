"""The figures of the page with their captions."""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.figure import Figure

from mocap_jax.recording import Recording
from mocap_jax.report.angle_figures import hinge_figure, trunk_figure
from mocap_jax.report.confidence_figure import confidence_figure
from mocap_jax.report.position_figure import position_figure
from mocap_jax.report.range_figures import range_matrices
from mocap_jax.report.statistic_figures import cost_figure, residual_figure
from mocap_jax.report.statistic_streams import (
    range_pairs,
    source_colours,
    statistic_sources,
    unheard_pairs,
)
from mocap_jax.report.steps import constants_figure, rest_figure, steps_of
from mocap_jax.report.strip import motion_strip
from mocap_jax.report.style import embedded, embedded_raster
from mocap_jax.solution import Solution

_NAMES = ("trunk", "hinges", "ends", "bars", "cost", "confidence", "constants", "rest")


@dataclass(frozen=True)
class Picture:
    """A figure and what it shows."""

    address: str
    caption: str
    title: str = ""


def all_pictures(
    solutions: dict[str, Solution],
    recording: Recording | None,
    palette: dict[str, str],
    *,
    scored: bool,
) -> dict[str, object]:
    """All figures by their place on the page (None, or an empty list: nothing to show).

    Args:
        solutions: by the name shown.
        recording: what they were estimated from.
        palette: colours by name.
        scored: whether the recording's truth can be compared with them.
    """
    if not solutions:
        return dict.fromkeys(_NAMES) | {"strips": [], "matrices": []}
    reference = recording if scored else None
    return {
        **_motion(solutions, reference, palette),
        **_statistics(solutions, palette),
        **_found(solutions, reference, palette),
        "confidence": _raster(
            _confidence(solutions, recording),
            "Confidence of every distance over time, averaged over short intervals: blue is a "
            "clear path, pale an obstructed one (by the body, or heard as an echo), which is "
            "normal while limbs move. One panel a source, one line a receiver (compare Vlasic "
            "2007, figure 5). Estimators weight distances by it.",
        ),
    }


def _confidence(solutions: dict[str, Solution], recording: Recording | None) -> Figure | None:
    """With the pairs grey that no method could use."""
    unheard = [u for s in solutions.values() if range_pairs(s) and (u := unheard_pairs(s))]
    shared = frozenset.intersection(*unheard) if unheard else frozenset()
    return confidence_figure(recording, shared) if recording is not None else None


def _motion(
    solutions: dict[str, Solution], reference: Recording | None, palette: dict[str, str]
) -> dict[str, object]:
    against = " Grey: truth." if reference is not None else ""
    band = " Bands: two stated standard deviations to either side (smoothers and optimisers state "
    band += "them from all data, a filter from the past alone)."
    last = list(solutions)[-1]
    strips = [
        _picture(
            motion_strip(s, reference, colour=palette[n]),
            "Eight moments, evenly spaced." + (
                " Dark lines, and grey behind: the true pose, on the same root. White lines: the "
                "estimate's own limbs." if reference else ""
            ),
            n,
        )
        for n, s in solutions.items() if n == last
    ]  # fmt: skip
    return {
        "strips": strips,
        "trunk": _raster(
            trunk_figure(solutions, palette, reference),
            "Rotation of head, right upper arm and left thigh relative to the root segment, as "
            "Z-X-Y Cardan angles (gaps: within 5 degrees of gimbal lock)." + against + band + (
                " Bottom: angle between the estimated and the true rotation; the tinted area is "
                "twice the standard deviation that the covariance states." if reference else ""
            ) + " Pale stretch at the start: rest hold and blend, not scored. The layout of Vlasic "
            "2007, figure 6.",
        ),
        "hinges": _raster(
            hinge_figure(solutions, palette, reference),
            "Flexion of elbows and knees." + against + band,
        ),
        "ends": _raster(
            position_figure(solutions, palette, reference),
            "Hands and feet in the frame of the pelvis." + against + band + " They leave out how "
            "well the pelvis itself is known, and wrong segment lengths.",
        ),
    }  # fmt: skip


def _statistics(solutions: dict[str, Solution], palette: dict[str, str]) -> dict[str, object]:
    sources = statistic_sources(solutions)
    return {
        "bars": _picture(
            residual_figure(sources, source_colours(sources, palette)),
            "Root mean square of residuals and innovations, divided by the standard deviation that "
            "the estimator gives them. About 1 (dashed): they are as large as assumed. Below: the "
            "assumed model error (soft tissue, timing) was larger than needed. Above: an error "
            "that is not in the model.",
        ),
        "matrices": [
            _raster(range_matrices(s), "", name)
            for name, s in sources.items()
            if any(k.startswith("range/") for k in s.statistics)
        ],
        "cost": _picture(
            cost_figure(solutions, palette),
            "Half the sum of squared whitened residuals. It jumps where a new round begins with "
            "re-estimated noise levels; values of different rounds do not compare.",
        ),
    }


def _found(
    solutions: dict[str, Solution], reference: Recording | None, palette: dict[str, str]
) -> dict[str, object]:
    steps = steps_of(solutions, palette, reference)
    known = any(step.truth for step in steps)
    return {
        "constants": _picture(
            constants_figure(steps),
            ("Distance between true and estimated constants of every sensor (length of the vector "
             "difference): " if known else "Constants of every sensor (length of the vector): ")
            + "as declared (zero), after the rest hold (filters use that result and leave it as it "
            "is) and after the optimiser. Bars: the standard deviation that the step states.",
        ),
        "rest": _picture(
            rest_figure(solutions, palette, reference),
            "Pose in the middle of the rest hold, by segment relative to its parent. Left: how far "
            "it was found from the declared pose"
            + ("; right: how far from the true one (hollow: the declared pose)." if known else "."),
        ),
    }  # fmt: skip


def _picture(figure: Figure | None, caption: str, title: str = "") -> Picture | None:
    return Picture(embedded(figure), caption, title) if figure is not None else None


def _raster(figure: Figure | None, caption: str, title: str = "") -> Picture | None:
    return Picture(embedded_raster(figure), caption, title) if figure is not None else None

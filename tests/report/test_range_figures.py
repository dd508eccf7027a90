"""Distances by pair: those that cannot hear each other are no faults; few numbers are written."""

import dataclasses

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.patches import Rectangle
from small_person import SENSORS, person, recording, solution, swing

from mocap_jax.recording import RangeStream
from mocap_jax.report.confidence_figure import confidence_figure
from mocap_jax.report.range_figures import range_matrices
from mocap_jax.report.statistic_streams import unheard_pairs
from mocap_jax.report.style import EXCLUDED

HEARD = {"count": 80, "heard": 90, "rejected": 0.1, "rms_units": 0.02, "bias_units": 0.005,
         "lowered": 0.02}  # fmt: skip
STATISTICS = {
    "range/hat-pelvis": HEARD,
    "range/hat-left_thigh": HEARD | {"bias_units": 0.123, "rms_units": 0.2, "lowered": 0.5},
    "range/hat-right_forearm": HEARD | {"count": 3, "bias_units": 0.9},
    "range/hat-head": {"count": 0, "heard": 43, "rejected": 1.0},
    "range/belly-pelvis": HEARD,
    "range/belly-left_thigh": HEARD,
    "range/belly-right_forearm": HEARD,
}
UNHEARD = {("hat", "head"), ("belly", "head")}


@pytest.fixture(scope="module")
def made():
    body = person()
    return solution(body, swing(body), statistics=STATISTICS)


@pytest.fixture(scope="module")
def matrices(made):
    return range_matrices(made)


def panel(matrices, title: str):
    return next(a for a in matrices.axes if a.get_title(loc="left") == title)


def grey(axes) -> int:
    patches = [p for p in axes.patches if isinstance(p, Rectangle)]
    return sum(p.get_facecolor() == to_rgba(EXCLUDED) for p in patches)


def test_pairs_always_behind_or_silent_cannot_hear(made):
    assert unheard_pairs(made) == UNHEARD


def test_excluded_pairs_are_grey_and_hold_no_value(matrices):
    for title in ("Distances used", "Bias", "RMS", "Outliers"):
        axes = panel(matrices, title)
        assert grey(axes) == len(UNHEARD), title
        cells = np.ma.filled(axes.images[0].get_array().astype(float), np.nan)
        assert np.isnan(cells[1]).all(), title  # the head, which hears neither source
    entries = [t.get_text() for t in matrices.legends[0].get_texts()]
    assert "cannot hear each other (no fault)" in entries
    assert any(t.startswith("fewer than 10 used") for t in entries)


def test_only_notable_values_are_written(matrices):
    written = {t: [x.get_text() for x in panel(matrices, t).texts] for t in ("Bias", "RMS")}
    assert written == {"Bias": ["+123"], "RMS": ["200"]}
    assert [x.get_text() for x in panel(matrices, "Outliers").texts] == ["50"]
    assert not panel(matrices, "Distances used").texts


def test_scales_say_what_they_measure(matrices):
    labels = [a.get_ylabel() for a in matrices.axes]
    for part in ("number used", "measured minus predicted [mm]", "lost weight [%]"):
        assert any(part in label for label in labels), part


def test_without_ranges_there_is_no_figure(made):
    assert range_matrices(dataclasses.replace(made, statistics={})) is None


def test_confidence_draws_excluded_pairs_grey(made):
    n = 600
    ranges = RangeStream(
        np.linspace(0, 5, n), np.arange(n) % 2, np.arange(n) % 3, np.full(n, 0.5),
        np.linspace(0, 1, n), ("source/belly", "source/hat"), SENSORS[:3],
    )  # fmt: skip
    heard = dataclasses.replace(recording(made.trajectory), ranges=ranges)
    figure = confidence_figure(heard, frozenset({("hat", "head")}))
    belly, hat = figure.axes[:2]
    assert (grey(belly), grey(hat)) == (0, 1)
    assert np.ma.getmaskarray(np.ma.masked_invalid(hat.images[0].get_array()))[1].all()
    entries = [t.get_text() for t in figure.legends[0].get_texts()]
    assert entries == ["cannot hear each other (no fault)", "nothing received"]
    plain = confidence_figure(heard)
    assert [t.get_text() for t in plain.legends[0].get_texts()] == ["nothing received"]

"""Ratios between rows, each with its target."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vlasic2007.cells import CHAINS, METHODS
from vlasic2007.paper import ALL, COMBINATIONS, ODD
from vlasic2007.results import Results

Section = tuple[str, str]


def check_lines(results: Results) -> list[str]:
    """One line a check, by motion."""
    lines = []
    for section in results.sections:
        heading = f"{section[0]}, {section[1]}"
        found = list(_of_section(results, section))
        lines += ["", f"ratios, {heading}", *(f"  {line}" for line in found)] if found else []
    return lines


def _of_section(results: Results, section: Section) -> Iterator[str]:
    if section[1] == "field":
        yield from _without_gyroscopes(results, section)
        yield from _best(results, section)
        yield from _gain(results, section)
    yield from _never_worse(results, section)
    if section[1] == "paper":
        yield from _consistency(results, section)
    if section[1].endswith(CHAINS["raw"]):
        yield from _from_waveforms(results, section)


def _without_gyroscopes(results: Results, section: Section) -> Iterator[str]:
    """Section 6: the filter performs poorly with A, D or both."""
    for combination in ODD:
        both = results.pair(section, (combination, "ekf"), (ALL, "ekf"))
        if both:
            yield _line(f"tuned EKF, three joints, {combination} / {ALL}",
                        both[0].mean / both[1].mean, ">= 3")  # fmt: skip


def _best(results: Results, section: Section) -> Iterator[str]:
    """Section 6: the best results need all sensors."""
    rows = [results.row(section, c, "ekf") for c in COMBINATIONS]
    known = {row.combination: row.mean for row in rows if row is not None and row.folded}
    if len(known) > 1:
        order = sorted(known, key=known.__getitem__)
        listed = ", ".join(f"{c} {known[c]:.2f}" for c in order)
        yield f"tuned EKF, three joints [deg], best first: {listed}   (target: {ALL} first)"


def _gain(results: Results, section: Section) -> Iterator[str]:
    """What the whole sequence brings with all sensors."""
    for method, target in (("smoothed", "<= 0.9"), ("ekf", "<= 0.6")):
        both = results.pair(section, (ALL, "optimise"), (ALL, method))
        if both:
            yield _line(f"observed joints, {ALL}, optimiser / {method}",
                        both[0].observed / both[1].observed, target)  # fmt: skip
    row = results.row(section, ALL, "optimise")
    if row is not None:
        yield _line(f"observed joints, {ALL}, optimiser [deg]", row.observed, "<= 4")


def _from_waveforms(results: Results, section: Section) -> Iterator[str]:
    """What the way over the wires costs, on the seeds of which both are there."""
    other = (section[0], section[1].removesuffix(CHAINS["raw"]) + CHAINS["wired"])
    for combination in COMBINATIONS:
        for method in METHODS:
            seeds = frozenset(results.scores(section, combination, method)) & frozenset(
                results.scores(other, combination, method)
            )
            one, two = (results.row(s, combination, method, seeds) for s in (section, other))
            if one is None or two is None or not (one.folded and two.folded):
                continue
            what = f"{combination}, {METHODS[method]}, from waveforms / direct"
            yield _line(f"three joints, {what}", one.mean / two.mean, "<= 1.1",
                        f"({one.mean:.3g} / {two.mean:.3g} deg)")  # fmt: skip
            yield _line(f"observed joints, {what}", one.observed / two.observed, "<= 1.1",
                        f"({one.observed:.3g} / {two.observed:.3g} deg)")  # fmt: skip


def _never_worse(results: Results, section: Section) -> Iterator[str]:
    """The optimiser starts from the smoothed filter and should not lose by it."""
    for combination in COMBINATIONS:
        both = results.pair(section, (combination, "optimise"), (combination, "smoothed"))
        if not both or (combination == ALL and section[1] == "field"):
            continue
        one, other = both
        joints = f"three joints {one.mean:.3g} / {other.mean:.3g} deg"
        if one.observed == one.observed:
            numbers = f"({one.observed:.3g} / {other.observed:.3g} deg; {joints})"
            yield _line(f"observed joints, {combination}, optimiser / smoothed",
                        one.observed / other.observed, "<= 1.02", numbers)  # fmt: skip
        else:
            yield _line(f"three joints, {combination}, optimiser / smoothed",
                        one.mean / other.mean, "<= 1.02", f"({joints})")  # fmt: skip


def _consistency(results: Results, section: Section) -> Iterator[str]:
    """Whether the optimiser's own covariance is honest, with all sensors."""
    scores = results.scores(section, ALL, "optimise").values()
    found = [s["consistency"] for s in scores if "consistency" in s]
    if found:
        rms = np.sqrt(np.mean([f["rms"] ** 2 for f in found]))
        predicted = np.sqrt(np.mean([f["predicted_rms"] ** 2 for f in found]))
        coverage = 100 * np.mean([f["coverage"] for f in found])
        yield _line(f"observed joints, {ALL}, optimiser, RMS error / predicted",
                    rms / predicted, "<= 1.2")  # fmt: skip
        yield _line(f"observed joints, {ALL}, optimiser, inside 95 % intervals [%]",
                    coverage, "90 to 98")  # fmt: skip


def _line(what: str, value: float, target: str, more: str = "") -> str:
    return f"{what:66s} {value:8.3f}   (target {target}) {more}".rstrip()

"""The tables of the reproduction, from the cells that are there."""

from __future__ import annotations

import numpy as np
from estimate_store import Store

from placement.cells import Clip
from placement.plan import OTHERS, Plan

_MOST_OF_SIP, _LEAST_CORRELATION, _MOST_LOSS = 0.8, 0.8, 0.10


def report(plan: Plan, store: Store) -> str:
    """All parts asked for as Markdown."""
    parts = {
        "six": _six, "clips": _clips, "random": _random, "hands": _hands,
        "correlation": _correlation, "sources": _sources,
    }  # fmt: skip
    chosen = [parts[p](plan, store) for p in parts if p in plan.arguments.parts]
    return "\n\n".join(["# Sensor placement", *chosen]) + "\n"


def _errors(
    plan: Plan, store: Store, suit: str, seeds: range, clip: Clip | None = None
) -> np.ndarray:
    """Mean joint position errors [cm] of the seeds that are done."""
    found = [store.get(plan.cell(suit, k, clip)) for k in seeds]
    return np.array([r["position_cm"]["mean"] for r in found if r is not None])


def _line(name: str, errors: np.ndarray) -> str:
    if not len(errors):
        return f"| {name} | - | - | 0 |"
    spread = f"{errors.std():.2f}"
    return f"| {name} | {errors.mean():.2f} | {spread} | {len(errors)} |"


_HEAD = "| placement | mean error [cm] | std over seeds | seeds |\n| --- | --- | --- | --- |"


def _verdict(met: bool | None, text: str) -> str:
    return f"{'not known yet' if met is None else 'met' if met else 'NOT MET'}: {text}"


def _six(plan: Plan, store: Store) -> str:
    seeds = range(plan.arguments.seeds)
    one, other = (_errors(plan, store, s, seeds) for s in ("sip6", "chosen"))
    ratio = other.mean() / one.mean() if len(one) and len(other) else None
    met = None if ratio is None else bool(ratio <= _MOST_OF_SIP)
    names = ", ".join(b.segment for b in plan.chosen)
    return "\n".join([
        "## Six sensors", "", f"Chosen: {names}.", "", _HEAD, _line("sip6_head", one),
        _line("chosen", other), "",
        _verdict(met, f"ratio {ratio:.2f}" if ratio is not None else "ratio") +
        f" (target at most {_MOST_OF_SIP})",
    ])  # fmt: skip


def _clips(plan: Plan, store: Store) -> str:
    seeds = range(min(plan.arguments.seeds, 5))
    rows, means = [], []
    for clip in OTHERS:
        pair = [_errors(plan, store, s, seeds, clip) for s in ("sip6", "chosen")]
        if all(len(e) for e in pair):
            means.append([e.mean() for e in pair])
            one, other = (f"{e.mean():.2f} +- {e.std():.2f}" for e in pair)
            ratio = means[-1][1] / means[-1][0]
            rows.append(f"| {clip.label} | {one} | {other} | {ratio:.2f} | {len(pair[1])} |")
    if not means:
        return "## Clips of other people\n\n" + _verdict(None, "no clip is done")
    one, other = np.mean(means, axis=0)
    rows.append(f"| mean | {one:.2f} | {other:.2f} | {other / one:.2f} | |")
    return "\n".join([
        "## Clips of other people", "",
        "| clip | sip6_head [cm] | chosen [cm] | ratio | seeds |",
        "| --- | --- | --- | --- | --- |", *rows, "",
        _verdict(bool(other / one <= _MOST_OF_SIP),
                 f"ratio {other / one:.2f} (target at most {_MOST_OF_SIP})"),
    ])  # fmt: skip


def _random(plan: Plan, store: Store) -> str:
    chosen = _errors(plan, store, "chosen", range(1))
    errors = [_errors(plan, store, n, range(1)) for n in plan.random_names()]
    done = np.concatenate([*errors, np.zeros(0)])
    met = bool(chosen[0] <= done.min()) if len(done) and len(chosen) else None
    text = "chosen"
    if met is not None:
        text = f"chosen {chosen[0]:.2f} cm, best of {len(done)} random {done.min():.2f} cm, " \
               f"median {np.median(done):.2f} cm"  # fmt: skip
    return "## Random placements\n\n" + _verdict(met, text)


def _hands(plan: Plan, store: Store) -> str:
    seeds = range(min(plan.arguments.seeds, 5))
    one, other = (_errors(plan, store, s, seeds) for s in ("sip6", "ends"))
    met = bool(other.mean() > one.mean()) if len(one) and len(other) else None
    return "\n".join([
        "## Hands and feet instead of forearms and shanks", "", _HEAD, _line("sip6_head", one),
        _line("hands and feet", other), "", _verdict(met, "hands and feet are worse"),
    ])  # fmt: skip


def _correlation(plan: Plan, store: Store) -> str:
    names = plan.random_names()[: plan.arguments.correlated]
    done = [(n, e[0]) for n in names if len(e := _errors(plan, store, n, range(1)))]
    if len(done) < 3:
        return "## Predicted and achieved error\n\n" + _verdict(None, f"{len(done)} placements")
    expected = plan.expected(tuple(n for n, _ in done))
    x, y = np.array([expected[n] for n, _ in done]), np.array([e for _, e in done])
    correlation = float(np.corrcoef(x, y)[0, 1])
    rows = [f"| {n} | {expected[n]:.2f} | {e:.2f} |" for n, e in done]
    return "\n".join([
        "## Predicted and achieved error", "", "| placement | predicted [cm] | achieved [cm] |",
        "| --- | --- | --- |", *rows, "",
        _verdict(correlation > _LEAST_CORRELATION,
                 f"correlation {correlation:.2f} over {len(done)} placements"),
    ])  # fmt: skip


def _sources(plan: Plan, store: Store) -> str:
    seeds = range(min(plan.arguments.seeds, 5))
    one, other = (_errors(plan, store, s, seeds) for s in ("eight_sources", "four_sources"))
    loss = other.mean() / one.mean() - 1 if len(one) and len(other) else None
    met = None if loss is None else bool(loss <= _MOST_LOSS)
    study = plan.sources
    return "\n".join([
        "## Four sources instead of eight", "",
        f"Kept: {', '.join(study['chosen'])} ({study['sentence']}). Expected error "
        f"{study['none_cm']:.2f} cm without distances, {study['all_cm']:.2f} with eight sources, "
        f"{study['expected_cm']:.2f} with these ({100 * study['loss']:+.1f} %).", "", _HEAD,
        _line("eight sources", one), _line("four sources", other), "",
        _verdict(met, f"loss {100 * loss:+.1f} %" if loss is not None else "loss"),
    ])  # fmt: skip

"""Which statistics a report shows: innovations of filters, residuals of optimisers, by stream."""

from __future__ import annotations

from mocap_jax.body.site_names import SOURCE_PREFIX
from mocap_jax.solution import Solution
from mocap_jax.solution.methods import FILTERS, SMOOTHERS

KINDS = ("accelerometer", "gyroscope", "orientation", "magnetometer", "gravity")


def statistic_sources(solutions: dict[str, Solution]) -> dict[str, Solution]:
    """Solutions with statistics of their own, by a name that says what these are.

    A smoother has no residuals of its own: it carries the innovations of its forward pass, which
    are the filter's. Beside a filter that has the same ones they are left out.
    """
    out: dict[str, Solution] = {}
    for name, solution in solutions.items():
        if not solution.statistics:
            continue
        filtered = solution.method in FILTERS
        if filtered and any(s.statistics == solution.statistics for s in out.values()):
            continue
        smoothed = solution.method in SMOOTHERS
        what = "forward pass, innovations" if smoothed else "innovations"
        out[f"{name}: {what if filtered else 'residuals'}"] = solution
    return out


def source_colours(sources: dict[str, Solution], colours: dict[str, str]) -> dict[str, str]:
    """The methods' colours by the names of `statistic_sources`."""
    return {name: colours[name.rpartition(": ")[0]] for name in sources}


def sensors_of(solution: Solution, kind: str) -> dict[str, dict[str, float]]:
    """Statistics of one kind of measurement by sensor."""
    prefix = f"{kind}/"
    return {
        key.removeprefix(prefix): value
        for key, value in solution.statistics.items()
        if key.startswith(prefix)
    }


def range_pairs(solution: Solution) -> dict[tuple[str, str], dict[str, float]]:
    """Statistics of ranges by (source, receiver)."""
    receivers = sorted((s.name for s in solution.setup.sensors), key=len, reverse=True)
    out = {}
    for key, value in sensors_of(solution, "range").items():
        known = next((r for r in receivers if key.endswith(f"-{r}")), None)
        receiver = known if known is not None else key.rpartition("-")[2]
        out[key[: len(key) - len(receiver) - 1], receiver] = value
    return out


def unheard_pairs(solution: Solution) -> frozenset[tuple[str, str]]:
    """Pairs (source, receiver) that cannot hear each other: the receiver is always behind.

    What the receiver picks up of such a source are echoes, and none of it is used. A pair whose
    distances all have confidence zero has no statistics, and belongs to them as well.
    """
    pairs = range_pairs(solution)
    sources, receivers = range_ends(solution)
    return frozenset(
        (s, r)
        for s in sources
        for r in receivers
        if (s, r) not in pairs or not pairs[s, r].get("count", 0.0)
    )


def range_ends(solution: Solution) -> tuple[list[str], list[str]]:
    """Sources and receivers that have statistics, in the set-up's order where it names them."""
    pairs = range_pairs(solution)
    declared = [s.removeprefix(SOURCE_PREFIX) for s in solution.setup.sources]
    sources = list(dict.fromkeys(source for source, _ in pairs))
    receivers = list(dict.fromkeys(receiver for _, receiver in pairs))
    worn = [s.name for s in solution.setup.sensors]
    place = lambda order: lambda name: order.index(name) if name in order else len(order)  # noqa: E731
    return sorted(sources, key=place(declared)), sorted(receivers, key=place(worn))

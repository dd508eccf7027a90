"""Warnings of `simulate`: anchors that are too far away for the slots."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocap_jax.body.site_names import ANCHOR_PREFIX

if TYPE_CHECKING:
    from mocap_jax.recording import RangeStream
    from mocap_jax.simulation import SimulationOptions
    from mocap_jax.simulation.raw import RawSimulation


def unheard_anchors(
    ranges: RangeStream | None, options: SimulationOptions, *, limited: bool = False
) -> tuple[str, ...]:
    """Which anchors have no distance to anything, in sentences.

    Args:
        ranges: those of the recording.
        options: of the simulation.
        limited: `--max-range` was given, so that longer slots change nothing.
    """
    if ranges is None:
        return ()
    import numpy as np

    out = []
    for names, index in (
        (ranges.source_names, np.asarray(ranges.source)),
        (ranges.receiver_names, np.asarray(ranges.receiver)),
    ):
        heard = {names[i] for i in np.unique(index[np.asarray(ranges.confidence) > 0])}
        out += [name for name in names if name.startswith(ANCHOR_PREFIX) and name not in heard]
    advice = f"--max-range says {options.max_range_m:g} m" if limited else None
    return _sentences(out, "no distance is measured to", advice or _slots(options.max_range_m))


def far_anchors(raw: RawSimulation, options: SimulationOptions) -> tuple[str, ...]:
    """Which anchors are never near enough to anything for a slot of the wires, in sentences."""
    import numpy as np

    from mocap_jax.signals.ultrasonic.bands import heard_in_slot

    farthest = heard_in_slot(options.pulse_interval_s)
    sources = raw.recording.setup.sources
    shortest = {
        name: raw.distance[raw.pulse_source == s].min(initial=np.inf)
        for s, name in enumerate(sources)
    } | {name: raw.distance[:, r].min(initial=np.inf) for r, name in enumerate(raw.wires)}
    far = [n for n, d in shortest.items() if n.startswith(ANCHOR_PREFIX) and d > farthest]
    return _sentences(far, "nothing comes near enough to", _slots(farthest))


def _slots(farthest: float) -> str:
    return f"the slots hear {farthest:.3g} m; longer ones (--pulse-interval) hear farther"


def _sentences(names: list[str], fault: str, advice: str) -> tuple[str, ...]:
    return (f"{fault} {', '.join(names)}: {advice}",) if names else ()

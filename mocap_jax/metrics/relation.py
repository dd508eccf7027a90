"""Do an estimate and a reference come from the same recording?"""

from __future__ import annotations

import numpy as np

from mocap_jax.recording import Recording
from mocap_jax.solution import Solution

# Facts of the set-up that tell recordings apart.
_FACTS = ("motion", "seed", "profile", "start_utc_ns", "subject")


def signs_of_another_recording(
    solution: Solution, reference: Recording | Solution
) -> tuple[str, ...]:
    """What speaks against the estimate and the reference being of one recording, in sentences.

    Sensors, declared facts (motion, subject, start, ...), rest hold and time span are compared;
    facts that only one side has are not.

    Args:
        solution: the estimate.
        reference: a recording, or another solution.
    """
    mine, other = solution.setup, reference.setup
    signs = []
    names, others = {s.name for s in mine.sensors}, {s.name for s in other.sensors}
    if names and others and names != others:
        signs.append(f"the sensors differ ({_some(names ^ others)} on one side only)")
    facts, other_facts = dict(mine.provenance), dict(other.provenance)
    if isinstance(reference, Recording):
        if reference.subject:
            other_facts.setdefault("subject", reference.subject)
        if reference.start_utc_ns:
            other_facts.setdefault("start_utc_ns", reference.start_utc_ns)
    signs += [
        f"{key} differs ({facts[key]} here, {other_facts[key]} in the reference)"
        for key in _FACTS
        if key in facts and key in other_facts and facts[key] != other_facts[key]
    ]
    if mine.rest != other.rest:
        signs.append("the declared rest holds differ")
    time, span = np.asarray(solution.trajectory.time), _span(reference)
    if len(time) and span is not None:
        step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        outside = (time < span[0] - 2 * step) | (time > span[1] + 2 * step)
        if outside.any():
            signs.append(
                f"{outside.sum()} of {len(time)} frames lie outside the reference's time "
                f"({span[0]:.2f} s to {span[1]:.2f} s)"
            )
    return tuple(signs)


def _span(reference: Recording | Solution) -> tuple[float, float] | None:
    if isinstance(reference, Recording):
        if reference.truth is None:
            return reference.interval
        time = np.asarray(reference.truth.trajectory.time)
    else:
        time = np.asarray(reference.trajectory.time)
    return (float(time[0]), float(time[-1])) if len(time) else None


def _some(names: set[str]) -> str:
    first = sorted(names)[:4]
    return ", ".join(first) + (", ..." if len(names) > 4 else "")

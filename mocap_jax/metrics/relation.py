"""Do an estimate and a reference come from the same recording?"""

from __future__ import annotations

import numpy as np

from mocap_jax.body import Body, load_body
from mocap_jax.recording import CUT_START, Recording
from mocap_jax.solution import Solution

# Facts of the set-up that tell recordings apart.
_FACTS = ("motion", "seed", "profile", "start_utc_ns", "subject")
# Those of them that make a comparison meaningless: another seed still has the same truth.
_IDENTITY = ("motion", "start_utc_ns", "subject")
# Segments of one body are equally long but for rounding in files [m].
_SAME_LENGTH = 1e-3


def signs_of_another_recording(
    solution: Solution, reference: Recording | Solution
) -> tuple[str, ...]:
    """What speaks against the estimate and the reference being of one recording, in sentences.

    Sensors, declared facts (motion, subject, start, ...), rest hold and time span are compared;
    facts that only one side has are not. Bodies are compared where something else differs as well:
    an estimate may be made with another body than the recording's own.

    Args:
        solution: the estimate.
        reference: a recording, or another solution.
    """
    signs = [
        *_differing_setup(solution, reference),
        *_differing_facts(solution, reference, _FACTS),
        *_other_rest(solution, reference),
        *_frames_outside(solution, _span(reference)),
    ]
    return (*signs, *(_differing_bodies(solution, reference) if signs else ()))


def contradictions(solution: Solution, reference: Recording | Solution) -> tuple[str, ...]:
    """Those signs of another recording that make errors against the reference meaningless.

    These are another motion, subject or start, frames beyond a whole recording's time, and another
    body where anything else differs too. Other sensors or another seed are not among them: errors
    against the truth of the same motion can be wanted.

    Args:
        solution: the estimate.
        reference: a recording, or another solution.
    """
    found = list(_differing_facts(solution, reference, _IDENTITY))
    if isinstance(reference, Recording) and not reference.salvage:
        found += _frames_outside(solution, _whole_span(reference))
    if signs_of_another_recording(solution, reference):
        found += _differing_bodies(solution, reference)
    return tuple(found)


def _differing_setup(solution: Solution, reference: Recording | Solution) -> list[str]:
    mine, other = solution.setup, reference.setup
    names, others = {s.name for s in mine.sensors}, {s.name for s in other.sensors}
    if names and others and names != others:
        return [f"the sensors differ ({_some(names ^ others)} on one side only)"]
    return []


def _differing_facts(
    solution: Solution, reference: Recording | Solution, keys: tuple[str, ...]
) -> list[str]:
    facts, other_facts = dict(solution.setup.provenance), dict(reference.setup.provenance)
    if isinstance(reference, Recording):
        if reference.subject:
            other_facts.setdefault("subject", reference.subject)
        if reference.start_utc_ns:
            other_facts.setdefault("start_utc_ns", reference.start_utc_ns)
    return [
        f"{key} differs ({facts[key]} here, {other_facts[key]} in the reference)"
        for key in keys
        if key in facts and key in other_facts and facts[key] != other_facts[key]
    ]


def _other_rest(solution: Solution, reference: Recording | Solution) -> list[str]:
    if CUT_START in solution.setup.provenance or CUT_START in reference.setup.provenance:
        return []  # a cut leaves of the hold what lies inside
    same = solution.setup.rest == reference.setup.rest
    return [] if same else ["the declared rest holds differ"]


def _frames_outside(solution: Solution, span: tuple[float, float] | None) -> list[str]:
    time = np.asarray(solution.trajectory.time)
    if not len(time) or span is None:
        return []
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    outside = (time < span[0] - 2 * step) | (time > span[1] + 2 * step)
    if not outside.any():
        return []
    return [
        f"{outside.sum()} of {len(time)} frames lie outside the reference's time "
        f"({span[0]:.2f} s to {span[1]:.2f} s)"
    ]


def _differing_bodies(solution: Solution, reference: Recording | Solution) -> list[str]:
    """Whether the nominal bodies have other segments, or segments of other lengths."""
    xml = reference.body_xml if isinstance(reference, Recording) else reference.body.xml
    if not xml or not solution.body.xml:
        return []
    mine, other = _joints(load_body(solution.body.xml)), _joints(load_body(xml))
    if mine.keys() != other.keys():
        return [
            f"the bodies differ (segments {_some(mine.keys() ^ other.keys())} on one side only)"
        ]
    apart = max((float(np.linalg.norm(mine[n] - other[n])) for n in mine), default=0.0)
    if apart < _SAME_LENGTH:
        return []
    return [f"the bodies differ (joints by up to {100 * apart:.1f} cm in their segments)"]


def _joints(body: Body) -> dict[str, np.ndarray]:
    """Place of every segment but the root in its parent [m]."""
    topology, place = body.topology, np.asarray(body.body_pos)
    return {n: place[i] for i, n in enumerate(topology.body_names) if topology.body_parent[i] > 0}


def _span(reference: Recording | Solution) -> tuple[float, float] | None:
    if isinstance(reference, Recording):
        if reference.truth is None:
            return reference.interval
        time = np.asarray(reference.truth.trajectory.time)
    else:
        time = np.asarray(reference.trajectory.time)
    return (float(time[0]), float(time[-1])) if len(time) else None


def _whole_span(recording: Recording) -> tuple[float, float] | None:
    """Time of measurements and truth together: a truth may cover a part of its recording."""
    spans = [s for s in (recording.interval, _span(recording)) if s is not None]
    return min(s[0] for s in spans), max(s[1] for s in spans)


def _some(names: set[str]) -> str:
    first = sorted(names)[:4]
    return ", ".join(first) + (", ..." if len(names) > 4 else "")

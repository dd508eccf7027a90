"""True values of estimated constants, in the terms in which an estimator states them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.body.site_displacement import site_displacement
from mocap_jax.body.site_names import SOURCE_PREFIX
from mocap_jax.metrics.align import truth_of
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution
from mocap_jax.solution.methods import FILTERS

Values = dict[str, Float[np.ndarray, "n"]]
_SENSORS = ("gyroscope", "accelerometer")
# Mountings are told as well, but from the body that the recording was made with: the solution's
# may be another, or have its sites turned by a calibration.
_AS_TOLD = ("source_offset/", "clock_offset/", "heading/")
# Ways of two bodies that differ by less are along each other [m].
_SAME = 1e-3


def constant_truth(solution: Solution, recording: Recording | None) -> Values:
    """True constants under the keys of `Solution.calibration`; those the recording knows.

    Biases drift: theirs are means over the rest hold for filters, whose constants come from it, and
    over the whole recording for the others; at knots they are those of the nearest piecewise linear
    course. Lengths and places come from the true body beside the
    solution's, where both have the same frames.

    Args:
        solution: its body and set-up say what the constants correct.
        recording: of the solution; None, or one without truth, gives nothing.
    """
    if recording is None or recording.truth is None:
        return {}
    told = {k: np.asarray(v, float) for k, v in recording.truth.parameters.items()}
    out = _from_bodies(solution.body, truth_of(recording)[0], solution)
    out |= {k: np.atleast_1d(v) for k, v in told.items() if k.startswith(_AS_TOLD)}
    for kind in _SENSORS:
        out |= _mean_biases(kind, told, _fraction(solution, recording))
        out |= _walks(kind, told, solution)
        # The simulator's scale is a factor, the estimators' an error.
        scale = f"{kind}_scale/"
        out |= {k: np.atleast_1d(v) - 1.0 for k, v in told.items() if k.startswith(scale)}
    if "speed_of_sound" in told:
        relative = told["speed_of_sound"] / solution.setup.speed_of_sound - 1.0
        out["speed_of_sound/air"] = np.atleast_1d(relative)
    return out


def _fraction(solution: Solution, recording: Recording) -> tuple[float, float]:
    """Begin and end, as shares of the recording, of the data that constants are estimated from."""
    rest = solution.setup.rest
    start, end = recording.interval
    if solution.method not in FILTERS or rest is None or end <= start:
        return 0.0, 1.0
    return (rest.start - start) / (end - start), (rest.end - start) / (end - start)


def _mean_biases(kind: str, told: Values, fraction: tuple[float, float]) -> Values:
    out = {}
    prefix = f"{kind}_bias/"
    for key, start in told.items():
        if not key.startswith(prefix):
            continue
        drift = told.get(f"{kind}_drift/{key.removeprefix(prefix)}")
        mean = np.zeros(3)
        if drift is not None and len(drift):
            first, last = (int(np.clip(round(f * len(drift)), 0, len(drift))) for f in fraction)
            mean = drift[min(first, len(drift) - 1) : max(last, first + 1)].mean(axis=0)
        out[key] = start + mean
    return out


def _walks(kind: str, told: Values, solution: Solution) -> Values:
    """Biases (n, 3) at the knots of a solution's walks, by least squares over the recording."""
    out = {}
    for key, found in solution.calibration.items():
        if not key.startswith(f"{kind}_bias_walk/"):
            continue
        sensor = key.split("/", 1)[1]
        drift, start = told.get(f"{kind}_drift/{sensor}"), told.get(f"{kind}_bias/{sensor}")
        if drift is None or start is None:
            continue
        knots = len(found)
        place = np.linspace(0, knots - 1, len(drift))
        hats = np.maximum(0.0, 1 - np.abs(place[:, None] - np.arange(knots)))
        out[key] = start + np.linalg.lstsq(hats, drift, rcond=None)[0]
    return out


def _from_bodies(nominal: Body, true: Body, solution: Solution) -> Values:
    """What differs between the body that was assumed and the true one."""
    out: Values = {}
    here, there = nominal.topology, true.topology
    for b, name in enumerate(here.body_names):
        if name not in there.body_names or not here.body_parent[b]:
            continue
        pair = np.asarray(nominal.body_pos)[b], np.asarray(true.body_pos)[there.body_index(name)]
        if (length := _stretch(*pair)) is not None:
            out[f"segment_length/{name}"] = np.array([length])
    for spec in solution.setup.sensors:
        if (found := site_displacement(nominal, true, spec.site)) is not None:
            out[f"mounting_offset/{spec.name}"], out[f"mounting_rotation/{spec.name}"] = found
    for site in solution.setup.sources:
        if (found := site_displacement(nominal, true, site)) is not None:
            out[f"source_position/{site.removeprefix(SOURCE_PREFIX)}"] = found[0]
    return out


def _stretch(nominal: Float[np.ndarray, "3"], true: Float[np.ndarray, "3"]) -> float | None:
    """Relative change of a length; None where the offset is none, or turned as well."""
    size = float(np.linalg.norm(nominal))
    if size < _SAME:
        return None
    along = float(true @ nominal) / size
    if np.linalg.norm(true - along * nominal / size) > _SAME:
        return None
    return along / size - 1.0

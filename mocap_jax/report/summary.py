"""The block on top of the page: what the data are, what was known, what came out."""

from __future__ import annotations

import numpy as np

from mocap_jax import __version__
from mocap_jax.recording import Recording, Setup
from mocap_jax.report.verdicts import listed
from mocap_jax.solution import Solution

_PROFILES = {
    "ideal": "no sensor errors",
    "paper": "white noise only",
    "field": "noise, biases, loose and misplaced boards, soft tissue, echoes, lost data",
}


def summary_rows(
    solutions: dict[str, Solution],
    recording: Recording | None,
    accuracy: str,
    uncertainty: str,
) -> list[tuple[str, str]]:
    """Pairs of a label and a sentence.

    Args:
        solutions: by the name shown.
        recording: what they were estimated from.
        accuracy: verdict on the errors; empty where nothing can be compared.
        uncertainty: verdict on the covariances, likewise.
    """
    rows = [
        ("Data", data_sentence(solutions, recording)),
        ("Root pose", root_sentence(solutions, recording)),
        ("Accuracy", accuracy),
        ("Stated uncertainty", uncertainty),
        ("Program", f"Page written by mocap_jax {__version__}."),
    ]
    return [(label, text) for label, text in rows if text]


def data_sentence(solutions: dict[str, Solution], recording: Recording | None) -> str:
    """Whether the data are simulated, and whether the true motion is known."""
    setup = recording.setup if recording is not None else next(iter(solutions.values())).setup
    known = recording is not None and recording.truth is not None
    if setup.provenance.get("simulated"):
        if known:
            after = "The true motion is known; errors below are against it."
        elif recording is None:
            after = "No recording was given with the solutions, so nothing is compared with the "
            after += "true motion."
        else:
            after = "The recording does not hold the true motion, so no errors can be given."
        return f"Simulated, not measured on a person{_simulation(setup)}. {after}"
    if known:
        return (
            "The recording holds a true motion, and errors below are against it; nothing says "
            "that it was simulated."
        )
    return "Not marked as simulated. The true motion is not known, so no errors can be given."


def _simulation(setup: Setup) -> str:
    """Motion, profile and seed, as far as they are named; begins with a colon or is empty."""
    facts = setup.provenance
    parts = [f"motion {facts['motion']}"] if facts.get("motion") else []
    if profile := facts.get("profile"):
        told = _PROFILES.get(str(profile))
        parts.append(f"error profile {profile}" + (f" ({told})" if told else ""))
    if "seed" in facts:
        parts.append(f"seed {facts['seed']}")
    return f": {', '.join(parts)}" if parts else ""


def root_sentence(solutions: dict[str, Solution], recording: Recording | None) -> str:
    """Whether the pose of the root was measured, or had to be found; by method if they differ."""
    told: dict[str, list[str]] = {}
    for name, solution in solutions.items():
        told.setdefault(_root_use(solution, recording), []).append(name)
    if len(told) == 1:
        return next(iter(told))
    return " ".join(f"{listed(names)}: {text[0].lower()}{text[1:]}" for text, names in told.items())


def _root_use(solution: Solution, recording: Recording | None) -> str:
    if not solution.body.has_free_root:
        return "Fixed: the body has no free root."
    asked = str(solution.options.get("root", ""))
    if asked == "free":
        return "Free: found from the worn sensors alone, no measured root pose was used."
    used = asked == "given" or "root" in solution.statistics
    if not used and asked == "auto" and recording is not None:
        # Estimators load slowly, and a page with given references needs none of them.
        from mocap_jax.estimate.inputs import measures_root

        used = measures_root(recording)
    if used:
        return _given(solution.setup)
    if asked != "auto":
        return "Not stated by the solution."
    if recording is not None:
        return "Free: the recording has no measured root pose."
    return "Given if the recording had a measured root pose, else free; the recording would tell."


def _given(setup: Setup) -> str:
    noise = setup.noise
    kind = "simulated measurement" if setup.provenance.get("simulated") else "measurement"
    return (
        f"Given: a {kind} of the root's pose was used (standard deviation "
        f"{1e3 * noise.root_position:.3g} mm and {np.rad2deg(noise.root_orientation):.2g} deg per "
        "axis), so finding the root is not part of this test."
    )

"""Estimation methods and presets of `reconstruct` and `demo`."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from mocap_jax.cli.exit_codes import UsageError

if TYPE_CHECKING:
    from mocap_jax.body import Body
    from mocap_jax.recording import Recording
    from mocap_jax.solution import Solution

METHODS = ("optimise", "ekf", "ukf", "orientation")
FILTERS = ("ekf", "ukf")
Root = Literal["auto", "given", "free"]
Process = Literal["white_jerk", "paper"]


@dataclass(frozen=True)
class Preset:
    """Named choices of `reconstruct`; arguments given besides it take precedence."""

    summary: str
    method: str = "optimise"
    kinds: str = "AGDO"
    """Measurements used."""
    process: Process = "white_jerk"
    """Process noise of the filter."""
    root: Root = "auto"
    sparse: bool = False
    """Use `sparse_options`."""


PRESETS = {
    "default": Preset("smoothed filter, then the whole sequence"),
    "paper": Preset(
        "the filter with the process noise printed by Vlasic 2007", "ekf", "AGD", "paper"
    ),
    "inertial": Preset("without distances and measured orientations", kinds="AG"),
    "sparse": Preset(
        "a few boards that report orientations: pose prior, boards that move on the skin, root "
        "free (after von Marcard 2017)",
        kinds="AGO",
        root="free",
        sparse=True,
    ),
}


def solve(
    recording: Recording,
    body: Body | None = None,
    *,
    method: str = "optimise",
    kinds: str = "AGDO",
    root: Root = "auto",
    process: Process = "white_jerk",
    smooth: bool = False,
    sparse: bool = False,
    contacts: bool = False,
    gravity: bool = False,
    initial: Solution | None = None,
    progress: bool = False,
) -> Solution:
    """Estimate with one of `METHODS`.

    Args:
        recording: the measurements.
        body: with the sensors' sites; default the recording's own.
        method: one of `METHODS`; "optimise" starts from the smoothed filter, "orientation" does
            the same from measured orientations alone.
        kinds: letters of "AGDOM".
        root: "given", "free" or "auto".
        process: process noise of the filter, "white_jerk" or "paper".
        smooth: with "ekf" and "ukf", run the backward smoother as well.
        sparse: with "optimise", use `sparse_options`.
        contacts: with "optimise", hold standing feet (`ContactOptions`).
        gravity: boards that do not accelerate tell tilt (`GravityOptions`).
        initial: with "optimise" and "orientation", where to start instead of the filter.
        progress: show progress bars on stderr.
    """
    from mocap_jax.estimate import EkfOptions, GravityOptions, ekf, ukf

    if method == "orientation":
        _require_orientations(recording)
        kinds = "O"
    tilt = GravityOptions() if gravity else None
    filtering = EkfOptions(kinds=kinds, root=root, process=process, smooth=smooth, gravity=tilt)
    if method in FILTERS:
        estimator = ekf if method == "ekf" else ukf
        return estimator(recording, body, options=filtering, progress=progress)
    from mocap_jax.estimate import ContactOptions, OptimiseOptions, optimise, sparse_options

    if initial is None and process != "white_jerk":
        smoothing = EkfOptions(
            kinds=kinds, root=root, process=process, smooth=True, covariance=False, gravity=tilt
        )
        initial = ekf(recording, body, options=smoothing, progress=progress)
    whole = sparse_options() if sparse else OptimiseOptions()
    feet = ContactOptions() if contacts else None
    whole = dataclasses.replace(whole, kinds=kinds, root=root, contacts=feet, gravity=tilt)
    solution = optimise(recording, body, initial=initial, options=whole, progress=progress)
    return dataclasses.replace(solution, method=method)


def _require_orientations(recording: Recording) -> None:
    from mocap_jax.estimate.inputs import measures_orientation

    if not measures_orientation(recording):
        raise UsageError(
            "--method orientation: the recording has no measured orientations; valid: optimise, "
            "ekf, ukf"
        )

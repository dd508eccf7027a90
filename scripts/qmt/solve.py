"""From the file to three estimates: frame by frame, and the whole sequence twice."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

NAMES = ("orientations, frame by frame", "whole sequence, contacts off", "contacts on")
# A sensor's place on its segment is only guessed, and so is its turn about the vertical at rest;
# model errors adapt.
PLACES, MOUNTING = 0.05, 0.1


class Estimates(NamedTuple):
    """Everything that the measures need."""

    recording: object
    calibration: object
    solutions: dict


def calibrate(file: Path, height: float):
    """The calibration: converted, orientations by VQF, pose at the still second at the start."""
    import mocap_jax as mj
    from mocap_jax.conversion import converted

    options = mj.ConvertOptions(orientation="vqf")
    recording = converted(file, mapping="qmt_full_body", options=options).recording
    return mj.calibrate_mounting(recording, mj.human(height))


def solve(calibration, seconds: float | None, rate_hz: float, keep: Path | None, say) -> Estimates:
    """The three estimates, each read from the folder `keep` if it is there already."""
    import mocap_jax as mj

    recording = calibration.recording
    if seconds is not None:
        recording = mj.cut(recording, None, seconds)
    solutions = {}
    for name in NAMES:
        file = keep / f"{name.replace(', ', '_').replace(' ', '_')}.mcap" if keep else None
        if file is not None and file.is_file():
            solutions[name] = mj.read_solution(file)
            continue
        start = solutions.get(NAMES[0])
        solutions[name] = _estimate(recording, calibration, name, start, rate_hz)
        say(f"{name}: {solutions[name].status.value} {solutions[name].iterations} steps, "
            f"{solutions[name].seconds_solve:.0f} s")  # fmt: skip
        if file is not None:
            mj.write_solution(file, solutions[name])
    return Estimates(recording, calibration, solutions)


def _estimate(recording, calibration, name: str, start, rate_hz: float):
    import mocap_jax as mj

    body = calibration.body
    if start is None:
        options = mj.OrientationPassOptions(rate_hz=rate_hz)
        return mj.orientation_pass(recording, body, start=calibration.pose, options=options)
    options = mj.OptimiseOptions(
        kinds="AG", root="free", rate_hz=rate_hz, covariance=False,
        constants=mj.ConstantsOptions(offset_sigma=PLACES, mounting_sigma=MOUNTING),
        contacts=mj.ContactOptions() if name == NAMES[2] else None,
    )  # fmt: skip
    return mj.optimise(recording, body, initial=start, options=options)

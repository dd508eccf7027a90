"""What self-calibration buys when boards are ill-mounted, and how honest its figures are."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from clips import load_clip

import mocap_jax as mj
from mocap_jax.report.constant_truth import constant_truth
from mocap_jax.simulation import PROFILES, Profile

_DEGREE = np.pi / 180


def badly_worn(*, soft_tissue: bool) -> Profile:
    """`field` with mountings 5 degrees and 2 cm off, lengths 3 % and the speed of sound 1 %."""
    field = PROFILES["field"]
    return dataclasses.replace(
        field,
        name="badly worn" if soft_tissue else "badly worn, no soft tissue",
        mounting_rotation=5 * _DEGREE,
        mounting_slide=0.02,
        segment_length=0.03,
        speed_of_sound=0.01,
        **({} if soft_tissue else {"tissue_frequency": 0.0, "tissue_slide": 0.0}),
    )


def options(*, calibrated: bool, scales: bool = False) -> mj.OptimiseOptions:
    """Priors of the size of those errors, scales among them or not; or no constants at all."""
    sigmas = {f.name: 0.0 for f in dataclasses.fields(mj.ConstantsOptions) if "sigma" in f.name}
    if not calibrated:
        return mj.OptimiseOptions(constants=mj.ConstantsOptions(**sigmas))  # type: ignore[arg-type]
    scale = PROFILES["field"].scale if scales else 0.0
    return mj.OptimiseOptions(
        constants=mj.ConstantsOptions(
            mounting_sigma=5 * _DEGREE, offset_sigma=0.02, source_sigma=0.02, length_sigma=0.03,
            sound_sigma=0.01, accelerometer_scale_sigma=scale, gyroscope_scale_sigma=scale,
        )
    )  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """One clip, one seed."""

    clip: str
    soft_tissue: bool
    seed: int
    without: float
    """Mean error of observed joints [deg] without constants."""
    calibrated: float
    """The same with them."""
    z: dict[str, np.ndarray]
    """Errors of constants over their stated deviations, by kind."""

    def inside(self, kind: str | None = None) -> float:
        """Share of constants (of a kind) within three stated deviations."""
        chosen = [v for k, v in self.z.items() if kind in (None, k)]
        return float((np.abs(np.concatenate(chosen)) <= 3).mean()) if chosen else float("nan")


def outcomes(
    clips: list[str],
    seeds: list[int],
    seconds: float | None,
    *,
    soft_tissue: bool,
    scales: bool = False,
) -> Iterator[Outcome]:
    """Simulate, then solve with and without constants from the same start."""
    for clip in clips:
        for seed in seeds:
            motion = load_clip(clip, seconds)
            recording = mj.simulate(motion, profile=badly_worn(soft_tissue=soft_tissue), seed=seed)
            start = mj.ekf(recording, options=mj.EkfOptions(smooth=True, covariance=False))
            errors, solution = [], start
            for calibrated in (False, True):
                chosen = options(calibrated=calibrated, scales=scales)
                solution = mj.optimise(recording, initial=start, options=chosen)
                table = mj.evaluate(solution, recording)
                errors.append(float(table["orientation_error_mean_deg"]["mean_observed"]))
            yield Outcome(clip, soft_tissue, seed, *errors, z=_normalised(solution, recording))


def _normalised(solution: mj.Solution, recording: mj.Recording) -> dict[str, np.ndarray]:
    found: dict[str, list[np.ndarray]] = {}
    for key, truth in constant_truth(solution, recording).items():
        if key not in solution.calibration:
            continue
        error = np.asarray(solution.calibration[key]) - truth
        deviation = np.asarray(solution.calibration_std[key])
        found.setdefault(key.split("/")[0], []).append(np.ravel(error / deviation))
    return {k: np.concatenate(v) for k, v in found.items()}

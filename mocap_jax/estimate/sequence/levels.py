"""`Levels`: how wrong the measurements are taken to be, and what that makes of the weights."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from mocap_jax.body import joint_dofs
from mocap_jax.estimate.sequence.layout import Layout
from mocap_jax.estimate.sequence.terms import Built
from mocap_jax.estimate.whole_sequence_options import ConstantsOptions, OptimiseOptions

_INERTIAL = ("accelerometer", "gyroscope", "orientation")
KINDS = (*_INERTIAL, "range")
INFORMATION = {
    "accelerometer": "force_information",
    "gyroscope": "rate_information",
    "orientation": "orientation_information",
    "range": "range_information",
}
SENSOR_KINDS = ("gyroscope_bias", "accelerometer_bias", "mounting", "offset")
CORRECTION_KINDS = (
    "accelerometer_scale", "gyroscope_scale", "clock_offset", "heading", "gyroscope_walk",
    "accelerometer_walk",
)  # fmt: skip
GEOMETRY_KINDS = ("length", "source", "sound", "range_offset")


@dataclass(frozen=True)
class Levels:
    """Model errors, as shares of the options' figures, and the priors' deviations."""

    share: dict[str, tuple[float, ...]]
    """Kind -> share of its model error in use, 0 to 1, per sensor (ranges: one for all)."""
    gyroscope_bias: float
    accelerometer_bias: float
    mounting: float
    offset: float
    accelerometer_scale: float
    gyroscope_scale: float
    clock_offset: float
    heading: float
    gyroscope_walk: float
    accelerometer_walk: float
    length: float
    source: float
    sound: float
    range_offset: float
    rest: float

    def with_full_share(self) -> Levels:
        """Levels with all model errors of inertial sensors."""
        full = {kind: (1.0,) * len(self.share[kind]) for kind in _INERTIAL}
        return dataclasses.replace(self, share=self.share | full)

    def same_shares(self, other: Levels) -> bool:
        """Whether the model errors are about the same."""
        flat = lambda x: np.concatenate(list(x.share.values()))  # noqa: E731
        return bool(np.allclose(flat(self), flat(other), rtol=0.15, atol=1e-3))


def declared_deviations(options: ConstantsOptions) -> dict[str, float]:
    """Prior standard deviations of the constants, by name."""
    kinds = (*SENSOR_KINDS, *CORRECTION_KINDS, *GEOMETRY_KINDS)
    stays = () if options.bias_interval else ("gyroscope_walk", "accelerometer_walk")
    return {kind: 0.0 if kind in stays else getattr(options, f"{kind}_sigma") for kind in kinds}


def initial_levels(options: OptimiseOptions, sensors: int) -> Levels:
    """The options' figures."""
    full = 1.0 if options.noise.model_errors else 0.0
    share = {kind: (full,) * (1 if kind == "range" else sensors) for kind in KINDS}
    return Levels(share, **declared_deviations(options.constants), rest=options.prior.rest_sigma)


def constant_cells(layout: Layout) -> dict[str, np.ndarray]:
    """Where each kind of constant stands among all of them (see `constant_values`).

    Kinds of `Corrections` that are off are not among them.
    """
    sensors = np.arange(layout.per_sensor * len(layout.sites)).reshape(-1, layout.per_sensor)
    cells = {
        name: sensors[:, at].ravel()
        for name, at in layout.sensor_cells.items()
        if at.stop > at.start
    }
    ends = sensors.size + np.cumsum([0, *layout.geometry_sizes])
    for i, name in enumerate(GEOMETRY_KINDS):
        cells[name] = np.arange(ends[i], ends[i + 1])
    return cells


def prior_information(levels: Levels, built: Built, repeats: float, *, last: bool) -> np.ndarray:
    """Inverse variances of all constants (m,); a zero deviation pins the constant.

    Model errors repeat with the motion, so data that have them speak for constants as if there
    were `repeats` times as many: the priors, which constants are weighed against, count as often.
    (Not those of gyroscope biases, which the rest hold shows, and of range offsets.) Those of the
    geometry do in the last round only: before, misfit of a clean recording whose body is wrong must
    be free to go where it belongs, or it would be taken for model errors of its sensors.
    """
    return prior_from(levels, built.layout, prior_counts(levels, built, repeats, last=last))


def prior_from(levels: Levels, layout: Layout, counts: np.ndarray) -> np.ndarray:
    """Inverse variances (m,) from deviations and how often each prior counts."""
    sigma = np.empty(layout.all_constants)
    for name, at in constant_cells(layout).items():
        sigma[at] = getattr(levels, name)
    return counts / np.maximum(sigma, 1e-7) ** 2


def prior_counts(levels: Levels, built: Built, repeats: float, *, last: bool) -> np.ndarray:
    """How often the prior of each constant counts (m,)."""
    layout = built.layout
    own = np.where(_wrong(levels, built), repeats, 1.0)
    shared = repeats if last and mostly_wrong(levels, built) else 1.0
    counts = np.repeat(own, layout.per_sensor)
    counts = np.concatenate([counts, np.full(layout.geometry, shared)])
    cells = constant_cells(layout)
    once = ("gyroscope_bias", "gyroscope_walk", "range_offset")
    counts[np.concatenate([cells[name] for name in once if name in cells])] = 1.0
    return counts


def _wrong(levels: Levels, built: Built) -> np.ndarray:
    """Which sensors have model errors in a kind that they measure (s,)."""
    measured = [np.isfinite(built.variances[kind][0]).any(axis=0) for kind in _INERTIAL]
    shares = np.array([levels.share[kind] for kind in _INERTIAL])
    return np.any(np.array(measured) & (shares > 0), axis=0)


def any_wrong(levels: Levels, built: Built) -> bool:
    """Whether a sensor, or the ranges, have model errors."""
    ranges = built.layout.use_range and levels.share["range"][0] > 0
    return bool(_wrong(levels, built).any() or ranges)


def mostly_wrong(levels: Levels, built: Built) -> bool:
    """Whether most sensors (or, without any, the ranges) have model errors."""
    wrong = _wrong(levels, built)
    return bool(2 * wrong.sum() > len(wrong)) if len(wrong) else levels.share["range"][0] > 0


def repeats(options: OptimiseOptions, frames: int) -> float:
    """How often one model error comes in a recording, at least 1."""
    return max(1.0, frames / options.noise.independent_samples)


def information(
    built: Built, gate: np.ndarray | None, levels: Levels, repeats: float
) -> dict[str, np.ndarray]:
    """Information arrays under given levels.

    Args:
        built: the problem's arrays.
        gate: w_a of every range, or None.
        levels: model errors and priors.
        repeats: see `prior_information`; the declared rest pose counts as often where most sensors
            have model errors. Roots keep theirs.
    """
    out = {}
    for kind, field in INFORMATION.items():
        declared, model = built.variances[kind]
        variance = declared + np.square(levels.share[kind]) * model
        out[field] = np.where(np.isfinite(variance), 1 / variance, 0.0)
    if gate is not None:
        out["range_information"] = out["range_information"] * gate
    if len(built.rest_frames):
        info = np.array(built.terms.reference_information)
        frames, joints = built.rest_frames, joint_dofs(built.layout.topology)
        often = repeats if mostly_wrong(levels, built) else 1.0
        info[0][np.ix_(frames, joints)] = often / (levels.rest**2 * len(frames))
        out["reference_information"] = info
    return out

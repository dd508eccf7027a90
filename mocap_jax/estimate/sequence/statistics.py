"""Residual statistics of a solved sequence, per sensor and per source-receiver pair."""

from __future__ import annotations

import numpy as np

from mocap_jax.body import Body
from mocap_jax.body.site_names import SOURCE_PREFIX
from mocap_jax.estimate.sequence.terms import Built
from mocap_jax.measurement import FrameData
from mocap_jax.residuals.robust import weight

_INERTIAL = {"accelerometer": "force", "gyroscope": "rate", "orientation": "orientation"}
# Squared whitened size beyond which a value counts as an outlier.
_OUTLIER = 9.0


def residual_statistics(
    residuals: dict[str, np.ndarray],
    changed: dict[str, np.ndarray],
    built: Built,
    data: FrameData,
    body: Body,
) -> dict[str, dict[str, float]]:
    """Per stream what `Solution.statistics` describes.

    Args:
        residuals: plain residuals (predicted minus measured) by kind.
        changed: the information arrays of the last solve.
        built: layout and terms.
        data: names of the sensors.
        body: names of sources and receivers.
    """
    out: dict[str, dict[str, float]] = {}
    for kind, name in _INERTIAL.items():
        info = changed[f"{name}_information"]
        for i, sensor in enumerate(data.sensors):
            used = info[:, i] > 0
            if used.any():
                out[f"{kind}/{sensor}"] = _row(-residuals[kind][used, i], info[used, i])
    if "range" in residuals:
        out |= _range_rows(residuals["range"], changed["range_information"], built, data, body)
    return out


def _row(residual: np.ndarray, info: np.ndarray) -> dict[str, float]:
    """Statistics of residuals (n, axes), measured minus predicted."""
    squared = (residual**2).mean(-1)
    whitened = squared * info
    weighted = (residual * info[:, None]).sum(0) / info.sum()
    means = weighted, (residual * np.sqrt(info)[:, None]).mean(0)
    bias_units, bias = (float(m[0]) if len(m) == 1 else float(np.linalg.norm(m)) for m in means)
    return {
        "rms": float(np.sqrt(whitened.mean())),
        "count": int(len(squared)),
        "rms_units": float(np.sqrt(whitened.sum() / info.sum())),
        "bias": bias,
        "bias_units": bias_units,
        "outliers": float((whitened > _OUTLIER).mean()),
    }


def _range_rows(
    residual: np.ndarray, info: np.ndarray, built: Built, data: FrameData, body: Body
) -> dict[str, dict[str, float]]:
    sites = built.layout.range_sites
    sensor_of = dict(zip(data.sites, data.sensors, strict=True))
    name = lambda i: sensor_of.get(sites[i], body.topology.site_names[sites[i]])  # noqa: E731
    out: dict[str, dict[str, float]] = {}
    heard, used = np.asarray(data.range_weight) > 0, info > 0
    ends = np.stack([built.terms.range_source, built.terms.range_receiver], -1)
    lowered = _lowered(residual**2 * info, built)
    for source, receiver in np.unique(ends[heard], axis=0):
        pair = heard & (ends == [source, receiver]).all(-1)
        chosen = pair & used
        row: dict[str, float] = {"count": int(chosen.sum()), "heard": int(pair.sum())}
        row["rejected"] = 1 - row["count"] / row["heard"]
        if chosen.any():
            row |= _row(-residual[chosen][:, None], info[chosen])
            row["lowered"] = float(lowered[chosen].mean())
        out[f"range/{name(source).removeprefix(SOURCE_PREFIX)}-{name(receiver)}"] = row
    return out


def _lowered(squared: np.ndarray, built: Built) -> np.ndarray:
    """Which ranges the robust loss leaves less than half of their weight."""
    # Of all at once: each new shape would be compiled.
    return np.asarray(weight(built.layout.range_loss, squared, built.weights.range_scale)) < 0.5

"""Residual statistics of a solved sequence, per sensor and per source-receiver pair."""

from __future__ import annotations

import numpy as np

from mocap_jax.body import Body
from mocap_jax.estimate.sequence.terms import Built
from mocap_jax.measurement import FrameData

_INERTIAL = {"accelerometer": "force", "gyroscope": "rate", "orientation": "orientation"}


def residual_statistics(
    residuals: dict[str, np.ndarray],
    changed: dict[str, np.ndarray],
    built: Built,
    data: FrameData,
    body: Body,
) -> dict[str, dict[str, float]]:
    """Per stream: count, RMS in units, whitened RMS, and the share of outliers.

    Args:
        residuals: plain residuals by kind.
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
                squared = (residuals[kind][used, i] ** 2).mean(-1)
                out[f"{kind}/{sensor}"] = _row(squared, squared * info[used, i])
    if "range" in residuals:
        out |= _range_rows(residuals["range"], changed["range_information"], built, data, body)
    return out


def _row(squared: np.ndarray, whitened: np.ndarray) -> dict[str, float]:
    return {
        "rms": float(np.sqrt(whitened.mean())),
        "count": int(len(squared)),
        "rms_units": float(np.sqrt(squared.mean())),
        "outliers": float((whitened > 9).mean()),
    }


def _range_rows(
    residual: np.ndarray, info: np.ndarray, built: Built, data: FrameData, body: Body
) -> dict[str, dict[str, float]]:
    sites = built.layout.range_sites
    sensor_of = dict(zip(data.sites, data.sensors, strict=True))
    name = lambda i: sensor_of.get(sites[i], body.topology.site_names[sites[i]])  # noqa: E731
    out = {}
    used = info > 0
    pairs = np.stack([built.terms.range_source[used], built.terms.range_receiver[used]], 1)
    squared = residual[used] ** 2
    whitened = squared * info[used]
    for source, receiver in np.unique(pairs, axis=0):
        chosen = (pairs == [source, receiver]).all(1)
        key = f"range/{name(source).removeprefix('source/')}-{name(receiver)}"
        out[key] = _row(squared[chosen], whitened[chosen])
    return out

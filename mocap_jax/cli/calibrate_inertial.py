"""What `calibrate accelerometer` and `calibrate gyroscope` print and write."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

import numpy as np

from mocap_jax.cli.calibrate_kind import warn, write_figures
from mocap_jax.cli.files import exit_code

if TYPE_CHECKING:
    from mocap_jax.calibration import AxisFit, InertialCalibration
    from mocap_jax.recording import Recording

_UNITS = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}


def finish(
    arguments: argparse.Namespace, found: InertialCalibration, recordings: list[Recording]
) -> int:
    """Print the table, write the files, and give the exit code."""
    from mocap_jax.io import SetupFigures

    print(_table(found))
    warn(found.skipped)
    results = {
        "kind": found.kind,
        "sensors": {name: _json(fit) for name, fit in found.sensors.items()},
        "skipped": found.skipped,
    }
    write_figures(arguments, SetupFigures(found.calibration), results)
    return exit_code(*recordings)


def _table(found: InertialCalibration) -> str:
    unit = _UNITS[found.kind]
    width = max(6, *(len(name) for name in found.sensors))
    lines = [
        f"{found.kind}: reading = zero + slope * true value; true length {found.length:.4f} {unit}",
        f"{'board':{width}s} axis  {f'zero [{unit}]':>21s}  {'slope [1]':>21s}  cross-axis [%]",
    ]
    for name, fit in found.sensors.items():
        c = fit.calibration
        for i, axis in enumerate("xyz"):
            lines.append(
                f"{name if i == 0 else '':{width}s} {axis:4s}  "
                f"{c.zero[i]:9.5f} +- {c.zero_sigma[i]:8.5f}  "
                f"{c.slope[i]:9.5f} +- {c.slope_sigma[i]:8.5f}  {100 * _across(fit)[i]:14.2f}"
            )
        count = len(fit.plateaus)
        lines.append(
            f"{'':{width}s} {count} positions"
            + (f", RMS of length {fit.residual:.5f} {unit}" if count > 6 else "")
        )
    lines.append(
        "cross-axis: response of the other two axes when this one is along the vector; skewed axes "
        "and leaning positions add up in it"
    )
    return "\n".join(lines)


def _across(fit: AxisFit) -> np.ndarray:
    """Response of the other axes to a vector along each."""
    off = fit.cross_axis - np.diag(np.diag(fit.cross_axis))
    return np.sqrt((off**2).sum(axis=0))


def _json(fit: AxisFit) -> dict[str, Any]:
    c = fit.calibration
    return {
        "zero": c.zero, "zero_sigma": c.zero_sigma, "slope": c.slope,
        "slope_sigma": c.slope_sigma, "cross_axis": fit.cross_axis.tolist(),
        "length_residual_rms": fit.residual,
        "positions": [
            {"recording": p.place or "1", "direction": p.direction, "start_s": p.start,
             "end_s": p.end}
            for p in fit.plateaus
        ],
    }  # fmt: skip

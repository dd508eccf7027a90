"""The same recording on every kind of device: how long it takes, and whether estimates agree."""

from __future__ import annotations

from importlib.resources import as_file, files
from typing import NamedTuple

import jax

import mocap_jax as mj


class Timing(NamedTuple):
    """One device: seconds of a second run, and the optimiser's error."""

    device: str
    filter_s: float
    """Filter and smoother."""
    optimise_s: float
    error_deg: float
    """Mean orientation error of the joints."""


def found() -> list[str]:
    """Kinds of devices that this JAX has, the processor last."""
    kinds = []
    for kind in ("gpu", "tpu", "cpu"):
        try:
            jax.devices(kind)
        except RuntimeError:
            continue
        kinds.append(kind)
    return kinds


def measure(kind: str) -> Timing:
    """Filter, smooth and optimise the bundled recording twice; the second time counts."""
    with as_file(files("mocap_jax") / "data" / "demo.mcap") as path:
        recording = mj.read_recording(path)
    with jax.default_device(jax.devices(kind)[0]):
        for _ in range(2):
            start = mj.ekf(recording, options=mj.EkfOptions(smooth=True))
            whole = mj.optimise(recording, initial=start)
    error = mj.evaluate(whole, recording).errors["orientation_error_mean_deg"]["mean"]
    return Timing(kind, start.seconds_solve, whole.seconds_solve, error)


def spread(timings: list[Timing]) -> float:
    """Largest difference between the devices' errors [deg]."""
    errors = [t.error_deg for t in timings]
    return max(errors) - min(errors)

"""What to do about a finding: the option that puts it right, and its choices."""

from __future__ import annotations

from collections.abc import Iterable

from mocap_jax.io.convert import (
    ACCELERATIONS,
    ACCELEROMETER_UNITS,
    GYROSCOPE_UNITS,
    QUATERNION_DIRECTIONS,
    QUATERNION_ORDERS,
    WORLD_UPS,
)

_CHOICES = {
    "--accelerometer-unit": tuple(ACCELEROMETER_UNITS),
    "--gyroscope-unit": tuple(GYROSCOPE_UNITS),
    "--quaternion-order": QUATERNION_ORDERS,
    "--quaternion-direction": QUATERNION_DIRECTIONS,
    "--gravity-sign": ("1", "-1"),
    "--acceleration": ACCELERATIONS,
    "--world-up": tuple(WORLD_UPS),
}
_OPTIONS = {
    "accelerometer reads": ("--accelerometer-unit",),
    "accelerometer is 9.8": ("--accelerometer-unit",),
    "gyroscope reads": ("--gyroscope-unit",),
    "gyroscope is 57": ("--gyroscope-unit",),
    "quaternions look": ("--quaternion-order",),
    "world-to-sensor": ("--quaternion-direction",),
    "gravity points down": ("--gravity-sign", "--world-up"),
    "gravity seems to be removed": ("--acceleration",),
    "axis up, not z": ("--world-up",),
}
"""Words of a finding -> options."""


def with_hints(findings: Iterable[str]) -> tuple[str, ...]:
    """The findings, each with the options that may put it right."""
    return tuple(text + hint(text) for text in findings)


def hint(finding: str) -> str:
    """Options for one finding, with their choices; empty where there is none."""
    options = dict.fromkeys(o for words, found in _OPTIONS.items() if words in finding
                            for o in found)  # fmt: skip
    if not options:
        return ""
    shown = "; ".join(f"{option} {'|'.join(_CHOICES[option])}" for option in options)
    return f" Options: {shown}."

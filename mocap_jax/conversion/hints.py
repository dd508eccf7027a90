"""What to do about a finding: the option, with its value, that puts it right."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

import numpy as np

from mocap_jax.io.convert import (
    ACCELEROMETER_UNITS,
    GYROSCOPE_UNITS,
    QUATERNION_DIRECTIONS,
    QUATERNION_ORDERS,
    Convention,
)

# What readings must be multiplied by, by the words of `initialise.sensor_units`.
_FORCE = {"reads in g;": 9.80665, "reads in mg;": 9.80665e-3, "is 9.8 times too large": 1 / 9.80665}
_RATE = {
    "reads in deg/s;": np.pi / 180, "is 57 times too small": 180 / np.pi,
    "reads in turns per second;": 2 * np.pi,
}  # fmt: skip
_UP = re.compile(r"has its (\S+) axis up, not z")
# Units agree within this share.
_SAME = 0.01


def with_hints(
    findings: Iterable[str],
    convention: Convention = Convention(),  # noqa: B008  (frozen)
) -> tuple[str, ...]:
    """The findings, each with the option that puts it right, given what the numbers were taken for.

    Args:
        findings: sentences of the checks.
        convention: what the file's numbers were taken for.
    """
    return tuple(text + hint(text, convention) for text in findings)


def hint(finding: str, convention: Convention = Convention()) -> str:  # noqa: B008  (frozen)
    """What to say of the option for one finding; empty where there is none."""
    options = [found for rule in _RULES for found in rule(finding, convention)]
    if not options:
        return ""
    return f" Option{'s' * (len(options) > 1)}: {' or '.join(dict.fromkeys(options))}."


def _accelerometer(finding: str, convention: Convention) -> list[str]:
    if "accelerometer" not in finding:
        return []
    now = ACCELEROMETER_UNITS[convention.accelerometer_unit]
    return _unit("--accelerometer-unit", finding, _FORCE, now, ACCELEROMETER_UNITS)


def _gyroscope(finding: str, convention: Convention) -> list[str]:
    if "gyroscope" not in finding:
        return []
    now = GYROSCOPE_UNITS[convention.gyroscope_unit]
    return _unit("--gyroscope-unit", finding, _RATE, now, GYROSCOPE_UNITS)


def _unit(
    option: str, finding: str, factors: dict[str, float], now: float, units: dict[str, float]
) -> list[str]:
    """The unit in which the readings would have been right."""
    wanted = [now * factor for words, factor in factors.items() if words in finding]
    names = [n for f in wanted for n, size in units.items() if abs(f / size - 1) < _SAME]
    return [f"{option} {name}" for name in names[:1]]


def _quaternions(finding: str, convention: Convention) -> list[str]:
    """Quaternions that look like another order or direction than they were taken for."""
    both = []
    if "quaternions look" in finding and convention.quaternion_order is not None:
        both.append(f"--quaternion-order {_other(convention.quaternion_order, QUATERNION_ORDERS)}")
    if "world-to-sensor, read" in finding:
        other = _other(convention.quaternion_direction, QUATERNION_DIRECTIONS)
        both.append(f"--quaternion-direction {other}")
    return [" ".join(both)] if both else []


def _other(name: str, pair: tuple[str, ...]) -> str:
    return pair[1 - pair.index(name)]


def _gravity(finding: str, convention: Convention) -> list[str]:
    if "gravity points down" in finding:
        sign = f"--gravity-sign {-convention.gravity_sign}"
        return [sign, "--world-up -z"] if convention.world_up == "z" else [sign]
    if "gravity seems to be removed" in finding:
        return ["--acceleration free-world", "free-sensor"]
    if (found := _UP.search(finding)) and convention.world_up == "z":
        return [f"--world-up {found[1]}"] if found[1] in ("x", "y") else []
    return []


_RULES: tuple[Callable[[str, Convention], list[str]], ...] = (
    _accelerometer, _gyroscope, _quaternions, _gravity,
)  # fmt: skip

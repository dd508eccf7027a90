"""The speed of sound at every pulse, from what is known about the air."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError
from mocap_jax.recording import Recording
from mocap_jax.recording.driver_box import CELSIUS
from mocap_jax.signals.ultrasonic.air import speed_of_sound, temperature

_PERCENT = (0.0, 100.0)


@dataclass(frozen=True)
class AirOptions:
    """What a recording does not say about the air."""

    celsius: float | None = None
    """Temperature instead of the recorded one [degrees Celsius]."""
    humidity: float | None = None
    """Relative [%]; None takes the air for dry, as 20.05 sqrt(T) does."""

    def __post_init__(self) -> None:
        for name, (low, high) in (("celsius", CELSIUS), ("humidity", _PERCENT)):
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise InputError(f"{name} {value:g}: valid are {low:g} to {high:g}")


def speed_at(
    recording: Recording, time: Float[np.ndarray, "n"], air: AirOptions
) -> Float[np.ndarray, "n"]:
    """Speed of sound [m/s] at given times [s]: by temperature, where that is known.

    The declared speed, which stands otherwise, is taken for that of dry air.
    """
    measured = recording.temperature
    if air.celsius is not None:
        celsius = np.full(len(time), air.celsius)
    elif measured is not None and len(measured.time):
        celsius = np.interp(time, np.asarray(measured.time), np.asarray(measured.celsius))
    else:
        celsius = np.full(len(time), temperature(recording.setup.speed_of_sound))
    return speed_of_sound(celsius, air.humidity or 0.0)


def by_wire(
    speed: Float[np.ndarray, "n"],
    wires: tuple[str, ...],
    celsius: Mapping[str, float],
    air: AirOptions,
) -> Float[np.ndarray, "n r"]:
    """Speed of sound at every pulse for every wire [m/s].

    Args:
        speed: where nothing else is known [m/s].
        wires: their names.
        celsius: readings of wires' own thermometers [degrees Celsius].
        air: a temperature in it takes the place of all readings.
    """
    common = np.broadcast_to(speed[:, None], (len(speed), len(wires)))
    own = {} if air.celsius is not None else celsius
    if not own:
        return common
    out = common.copy()
    for r, name in enumerate(wires):
        if name in own:
            out[:, r] = speed_of_sound(own[name], air.humidity or 0.0)
    return out

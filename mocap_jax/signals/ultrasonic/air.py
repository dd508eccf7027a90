"""Air: how fast sound is, and what it loses."""

from __future__ import annotations

import numpy as np
from jax.typing import ArrayLike

_KELVIN = 273.15
_SPEED = 20.05
_REFERENCE_KELVIN, _TRIPLE_KELVIN = 293.15, 273.16
_REFERENCE_KILOPASCAL = 101.325


def speed_of_sound(
    celsius: ArrayLike, humidity: float = 0.0, kilopascal: float = 101.325
) -> np.ndarray:
    """Speed of sound [m/s] in air: 20.05 sqrt(T in kelvin) where it is dry.

    An ideal gas has c^2 = gamma R T / M. A share x of water vapour has M smaller by 0.378 x of
    dry air's and gamma = (7 + x) / (5 + x).

    Args:
        celsius: temperature.
        humidity: relative [%].
        kilopascal: pressure.
    """
    kelvin = np.asarray(celsius, np.float64) + _KELVIN
    x = vapour_share(celsius, humidity, kilopascal)
    moist = (7.0 + x) / (5.0 + x) * (5.0 / 7.0) / (1.0 - 0.378 * x)
    return _SPEED * np.sqrt(kelvin * moist)


def vapour_share(celsius: ArrayLike, humidity: float, kilopascal: float = 101.325) -> np.ndarray:
    """Molar share of water vapour, ISO 9613-1:1993, equations B.1 to B.3; arguments as above."""
    kelvin = np.asarray(celsius, np.float64) + _KELVIN
    saturation = 10.0 ** (4.6151 - 6.8346 * (_TRIPLE_KELVIN / kelvin) ** 1.261)
    return 1e-2 * humidity * saturation * _REFERENCE_KILOPASCAL / kilopascal


def temperature(speed: ArrayLike) -> np.ndarray:
    """Temperature [degrees Celsius] of dry air in which sound has a speed [m/s]."""
    return (np.asarray(speed, np.float64) / _SPEED) ** 2 - _KELVIN


def absorption(
    frequency_hz: ArrayLike,
    celsius: float = 20.0,
    humidity: float = 50.0,
    kilopascal: float = 101.325,
) -> np.ndarray:
    """Absorption of pure tones by air [dB/m], ISO 9613-1:1993, equations 3 to 5 and B.3.

    Args:
        frequency_hz: of the tone.
        celsius: temperature.
        humidity: relative [%].
        kilopascal: pressure.
    """
    f = np.asarray(frequency_hz, np.float64)
    kelvin = celsius + _KELVIN
    warmth, pressure = kelvin / _REFERENCE_KELVIN, kilopascal / _REFERENCE_KILOPASCAL
    h = 100.0 * float(vapour_share(celsius, humidity, kilopascal))
    oxygen = pressure * (24.0 + 4.04e4 * h * (0.02 + h) / (0.391 + h))
    nitrogen = (
        pressure * warmth**-0.5 * (9.0 + 280.0 * h * np.exp(-4.170 * (warmth ** (-1 / 3) - 1)))
    )
    classical = 1.84e-11 * warmth**0.5 / pressure
    relaxing = 0.01275 * np.exp(-2239.1 / kelvin) / (oxygen + f**2 / oxygen)
    relaxing = relaxing + 0.1068 * np.exp(-3352.0 / kelvin) / (nitrogen + f**2 / nitrogen)
    return 8.686 * f**2 * (classical + warmth**-2.5 * relaxing)

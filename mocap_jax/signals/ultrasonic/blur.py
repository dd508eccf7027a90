"""How far noise shifts the mark of a burst, to first order in the noise."""

from __future__ import annotations

from math import comb

import numpy as np
from jaxtyping import Complex, Float


def blur(
    burst: Complex[np.ndarray, "n"],
    step: float,
    mark: float,
    offset_hz: Float[np.ndarray, "f"],
    power: Float[np.ndarray, "f"],
    order: int,
) -> float:
    """Deviation of a mark where the noise is as loud as the burst [s].

    The mark is where derivative `order` of the power |z|^2 is 0: 1 for its peak, 2 for its
    steepest rise. Noise w adds 2 Re(z* w) to the power; what that adds to the derivative at the
    mark is a sum over frequencies, and over the next derivative it is the shift. It is inversely
    proportional to the burst's amplitude in units of the noise's (parameter of its Rayleigh
    distribution).

    Args:
        burst: without noise, of unit amplitude.
        step: between its values [s].
        mark: place of the mark among them.
        offset_hz: frequencies about the carrier.
        power: of the noise at these.
        order: see above.
    """
    derivatives = [burst]
    for _ in range(order):
        derivatives.append(np.gradient(derivatives[-1], step))
    at = lambda x: np.interp(mark, np.arange(len(burst)), x)  # noqa: E731
    turn = 2j * np.pi * offset_hz
    share = sum(
        comb(order, k) * np.conj(at(derivatives[order - k])) * turn**k for k in range(order + 1)
    )
    slope = np.abs(burst) ** 2
    for _ in range(order + 1):
        slope = np.gradient(slope, step)
    noise = 2.0 * np.sqrt(np.average(np.abs(share) ** 2, weights=power))
    return float(noise / abs(at(slope)))

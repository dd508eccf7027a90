"""Arithmetic in GF(128), modulo x^7 + x^3 + 1, on arrays of symbols 0..127."""

from __future__ import annotations

import numpy as np
from jaxtyping import Int, UInt8

ORDER = 127
"""Of the multiplicative group."""
_POLYNOMIAL = 0b10001001


def _powers() -> np.ndarray:
    out, value = [], 1
    for _ in range(ORDER):
        out.append(value)
        value <<= 1
        if value & 128:
            value ^= _POLYNOMIAL
    return np.array(out, np.uint8)


def _products() -> tuple[np.ndarray, np.ndarray]:
    log = np.zeros(128, np.int64)
    log[_POWER] = np.arange(ORDER)
    product = _POWER[(log[:, None] + log) % ORDER]
    product[0] = product[:, 0] = 0
    inverse = _POWER[-log % ORDER]
    inverse[0] = 0
    return product.ravel(), inverse


_POWER = _powers()
# The table of all products is small enough to stay in the fastest cache.
_PRODUCT, _INVERSE = _products()


def power_of_alpha(exponent: Int[np.ndarray, "*b"]) -> UInt8[np.ndarray, "*b"]:
    """alpha ** exponent for any integer exponent."""
    return _POWER[np.asarray(exponent) % ORDER]


def multiply(a: UInt8[np.ndarray, "*b"], b: UInt8[np.ndarray, "*b"]) -> UInt8[np.ndarray, "*b"]:
    """Products, with broadcasting."""
    return _PRODUCT.take((np.asarray(a, np.int16) << 7) | b)


def inverse(a: UInt8[np.ndarray, "*b"]) -> UInt8[np.ndarray, "*b"]:
    """Reciprocals; that of zero is given as zero."""
    return _INVERSE.take(a)

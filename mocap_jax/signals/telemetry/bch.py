"""A BCH code of 92 bits that carries 50 and corrects any 6 wrong ones.

It is the primitive BCH code (127, 85) of designed distance 13, shortened by 35 bits (Lin and
Costello, Error Control Coding, chapter 6). Bits stand highest power first; all functions work on
many words at once.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Int, UInt8

from mocap_jax.signals.telemetry.galois import ORDER, inverse, multiply, power_of_alpha

LENGTH, DATA_BITS, CORRECTABLE = 92, 50, 6
_PARITY_BITS = LENGTH - DATA_BITS
_SYNDROMES = 2 * CORRECTABLE
_EXPONENTS = np.arange(LENGTH - 1, -1, -1)
"""Power of x that each bit of a word stands for."""
_BATCH = 2048
"""Words with errors that are decoded at once."""


def _minimal_polynomial(exponent: int) -> np.ndarray:
    """Coefficients (highest first) of the minimal polynomial of alpha ** exponent over GF(2)."""
    conjugates = sorted({exponent * 2**i % ORDER for i in range(7)})
    polynomial = np.array([1], np.uint8)
    for c in conjugates:
        shifted = np.append(polynomial, np.uint8(0))
        polynomial = shifted ^ np.append(
            np.uint8(0), multiply(polynomial, power_of_alpha(np.array(c)))
        )
    return polynomial


def _generator() -> np.ndarray:
    polynomial = np.array([1], np.int64)
    for exponent in range(1, _SYNDROMES, 2):
        polynomial = np.convolve(polynomial, _minimal_polynomial(exponent)) % 2
    return polynomial


def _parity_matrix() -> np.ndarray:
    """Rows: parity of each single data bit, that is x^k modulo the generator."""
    generator = _generator()
    rows = np.zeros((DATA_BITS, _PARITY_BITS), np.uint8)
    for i in range(DATA_BITS):
        remainder = np.zeros(LENGTH, np.int64)
        remainder[i] = 1
        for j in range(i, DATA_BITS):
            if remainder[j]:
                remainder[j : j + len(generator)] ^= generator
        rows[i] = remainder[DATA_BITS:]
    return rows


def _check_matrix() -> np.ndarray:
    """Bits of the syndromes S1, S3, ..., S11 that each bit of a word adds (92, 42)."""
    symbols = power_of_alpha(_EXPONENTS[:, None] * np.arange(1, _SYNDROMES, 2))
    return ((symbols[..., None] >> np.arange(7)) & 1).reshape(LENGTH, -1)


# Products of bits are summed in float32, where they are exact and fast.
_PARITY = _parity_matrix().astype(np.float32)
_CHECK = _check_matrix().astype(np.float32)


def encode(data: UInt8[np.ndarray, "n 50"]) -> UInt8[np.ndarray, "n 92"]:
    """Code words: the data bits followed by 42 parity bits."""
    parity = (data.astype(np.float32) @ _PARITY).astype(np.int64) & 1
    return np.concatenate([data, parity.astype(np.uint8)], axis=1)


def decode(
    words: UInt8[np.ndarray, "n 92"],
) -> tuple[UInt8[np.ndarray, "n 50"], Int[np.ndarray, "n"], Bool[np.ndarray, "n"]]:
    """Correct words.

    Returns:
        Data bits, number of bits corrected, and whether a code word lies within 6 bits; where
        none does, the data bits are those received.
    """
    odd = ((words.astype(np.float32) @ _CHECK).astype(np.int64) & 1).reshape(
        len(words), CORRECTABLE, 7
    )
    odd = (odd << np.arange(7)).sum(axis=2).astype(np.uint8)
    corrected = np.zeros(len(words), np.int64)
    sound = ~odd.any(axis=1)
    data = words[:, :DATA_BITS].copy()
    every = np.flatnonzero(~sound)
    for start in range(0, len(every), _BATCH):
        wrong = every[start : start + _BATCH]
        flips, found = _errors(_all_syndromes(odd[wrong]))
        sound[wrong] = found
        corrected[wrong] = np.where(found, flips.sum(axis=1), 0)
        data[wrong] ^= (flips & found[:, None])[:, :DATA_BITS].astype(np.uint8)
    return data, corrected, sound


def _all_syndromes(odd: UInt8[np.ndarray, "m 6"]) -> UInt8[np.ndarray, "m 12"]:
    out = np.zeros((len(odd), _SYNDROMES), np.uint8)
    out[:, ::2] = odd
    for j in range(2, _SYNDROMES + 1, 2):
        out[:, j - 1] = multiply(out[:, j // 2 - 1], out[:, j // 2 - 1])
    return out


def _errors(
    syndromes: UInt8[np.ndarray, "m 12"],
) -> tuple[Bool[np.ndarray, "m 92"], Bool[np.ndarray, "m"]]:
    """Wrong bits, and whether they explain the syndromes."""
    locator, degree = _locator(syndromes)
    powers = power_of_alpha(-_EXPONENTS[:, None] * np.arange(locator.shape[1]))
    value = np.zeros((len(locator), LENGTH), np.uint8)
    for k in range(locator.shape[1]):
        value ^= multiply(locator[:, k : k + 1], powers[:, k])
    roots = value == 0
    return roots, (degree <= CORRECTABLE) & (roots.sum(axis=1) == degree)


def _locator(syndromes: UInt8[np.ndarray, "m 12"]) -> tuple[np.ndarray, np.ndarray]:
    """Error locator polynomials (lowest power first) and their degrees, by Berlekamp-Massey."""
    m, size = len(syndromes), _SYNDROMES + 1
    locator, before = np.zeros((m, size), np.uint8), np.zeros((m, size), np.uint8)
    locator[:, 0] = before[:, 0] = 1
    length, last = np.zeros(m, np.int64), np.ones(m, np.uint8)
    for step in range(_SYNDROMES):
        discrepancy = np.zeros(m, np.uint8)
        for k in range(step + 1):
            discrepancy ^= multiply(locator[:, k], syndromes[:, step - k])
        # `before` is shifted by one power a step.
        before = np.concatenate([np.zeros((m, 1), np.uint8), before[:, :-1]], axis=1)
        scaled = multiply(multiply(discrepancy, inverse(last))[:, None], before)
        longer = (discrepancy != 0) & (2 * length <= step)
        kept = locator
        locator = locator ^ scaled
        before = np.where(longer[:, None], kept, before)
        last = np.where(longer, discrepancy, last)
        length = np.where(longer, step + 1 - length, length)
    return locator[:, : CORRECTABLE + 1], length

"""The block code, against the definition of a BCH code and random errors."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.signals.telemetry import bch
from mocap_jax.signals.telemetry.galois import inverse, multiply, power_of_alpha


def slow_product(a: int, b: int) -> int:
    """Carry-less product modulo x^7 + x^3 + 1."""
    out = 0
    for i in range(7):
        if b >> i & 1:
            out ^= a << i
    for i in range(13, 6, -1):
        if out >> i & 1:
            out ^= 0b10001001 << (i - 7)
    return out


def test_products_and_reciprocals_of_the_field():
    a, b = (x.astype(np.uint8) for x in np.divmod(np.arange(128 * 128), 128))
    expected = [slow_product(int(x), int(y)) for x, y in zip(a, b, strict=True)]
    np.testing.assert_array_equal(multiply(a, b), expected)
    np.testing.assert_array_equal(multiply(a[128:], inverse(a[128:])), 1)


def test_code_words_have_roots_at_twelve_powers_of_alpha():
    rng = np.random.default_rng(0)
    words = bch.encode(rng.integers(0, 2, (20, bch.DATA_BITS), dtype=np.uint8))
    for word in words:
        exponents = bch.LENGTH - 1 - np.flatnonzero(word)
        for j in range(1, 13):
            assert np.bitwise_xor.reduce(power_of_alpha(j * exponents)) == 0


@pytest.mark.parametrize("errors", range(7))
def test_up_to_six_errors_are_corrected(errors: int):
    rng = np.random.default_rng(errors)
    data = rng.integers(0, 2, (300, bch.DATA_BITS), dtype=np.uint8)
    words = bch.encode(data)
    for word in words:
        word[rng.choice(bch.LENGTH, errors, replace=False)] ^= 1
    decoded, corrected, sound = bch.decode(words)
    assert sound.all()
    np.testing.assert_array_equal(decoded, data)
    np.testing.assert_array_equal(corrected, errors)


def test_seven_errors_are_refused_or_end_in_another_code_word_never_in_silence():
    rng = np.random.default_rng(7)
    words = bch.encode(rng.integers(0, 2, (3000, bch.DATA_BITS), dtype=np.uint8))
    for word in words:
        word[rng.choice(bch.LENGTH, 7, replace=False)] ^= 1
    decoded, corrected, sound = bch.decode(words)
    assert sound.mean() < 0.02
    again = bch.encode(decoded[sound])
    np.testing.assert_array_equal((again != words[sound]).sum(axis=1), corrected[sound])


def test_noise_is_taken_for_a_word_as_often_as_the_spheres_fill_the_space():
    words = np.random.default_rng(1).integers(0, 2, (60_000, bch.LENGTH), dtype=np.uint8)
    share = bch.decode(words)[2].mean()
    assert 0.4e-4 < share < 4e-4  # 2^50 spheres of radius 6 in 2^92 words: 1.7e-4

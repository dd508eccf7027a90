"""Levels through the codec and back: noise, loss, overload, phase, precision."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.signals.telemetry.converter import (
    ConverterScales,
    accumulate,
    physical,
    quantise,
)
from mocap_jax.signals.telemetry.decode import FrameDecoder, Frames, join
from mocap_jax.signals.telemetry.delta import LARGEST, STEPS, demodulate, modulate
from mocap_jax.signals.telemetry.encode import encode
from mocap_jax.signals.telemetry.frame import (
    BIT_RATE_HZ,
    FRAME_BITS,
    PATTERN,
    SUPERFRAME_BITS,
    check_bits,
    interleave,
    pack,
    separate,
    unpack,
)
from mocap_jax.signals.telemetry.levels import restore


def wavy_levels(count: int, seed: int = 0, swing: float = 300.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.normal(0, 2, (count, 6)), axis=0)
    wave = swing * np.sin(np.arange(count)[:, None] / 15 + np.arange(6))
    return np.clip(2048 + walk + wave, 0, 4095).astype(np.int64)


def feed(bits: np.ndarray, piece: int = 10_000) -> Frames:
    decoder = FrameDecoder()
    return join([decoder.feed(bits[i : i + piece]) for i in range(0, len(bits), piece)])


def test_rate_fits_the_papers_13_kbit_per_second():
    assert BIT_RATE_HZ <= 13_000


def test_pattern_is_balanced_and_looks_like_no_shift_of_itself():
    signs = 1 - 2 * PATTERN.astype(int)
    assert abs(signs.sum()) < 80
    for shift in range(1, SUPERFRAME_BITS):
        assert abs((signs * np.roll(signs, shift)).sum()) < 0.2 * SUPERFRAME_BITS


def test_crc_matches_the_published_check_value():
    # CRC-8/AUTOSAR of "123456789" is 0xDF with a final inversion.
    bits = np.unpackbits(np.frombuffer(b"123456789", np.uint8))[None]
    assert np.packbits(check_bits(bits) ^ 1)[0] == 0xDF


def test_frames_come_back_as_packed():
    rng = np.random.default_rng(0)
    codes, halves = rng.integers(-31, 32, (50, 6)), rng.integers(0, 64, 50)
    words = pack(codes, halves)
    np.testing.assert_array_equal(separate(interleave(words)), words)
    out_codes, out_halves, _, accepted = unpack(words)
    assert accepted.all()
    np.testing.assert_array_equal(out_codes, codes)
    np.testing.assert_array_equal(out_halves, halves)


@pytest.mark.parametrize("piece", [97, 1104, 100_000])
def test_decoder_locks_at_any_phase_and_gives_every_level(piece: int):
    levels = wavy_levels(240)
    bits, modulated = encode(levels)
    noise_before = np.random.default_rng(1).integers(0, 2, 777, dtype=np.uint8)
    frames = feed(np.concatenate([noise_before, bits]), piece)
    restored = restore(frames)
    frame = (restored.bit - 777) // FRAME_BITS
    np.testing.assert_array_equal(frame, np.arange(240))
    np.testing.assert_array_equal(restored.values, modulated.levels)


def test_lock_in_the_middle_of_a_superframe():
    bits, modulated = encode(wavy_levels(240))
    restored = restore(feed(bits[5 * 184 + 33 :]))
    frame = (restored.bit + 5 * 184 + 33) // FRAME_BITS
    assert frame[0] == 12  # the next whole block
    np.testing.assert_array_equal(restored.values, modulated.levels[12:])


def test_a_burst_of_twelve_wrong_bits_is_corrected():
    bits, modulated = encode(wavy_levels(120))
    bits[1500:1512] ^= 1
    frames = feed(bits)
    assert frames.accepted.all()
    np.testing.assert_array_equal(restore(frames).values, modulated.levels)


def test_lost_frames_are_gaps_and_the_level_is_right_behind_them():
    bits, modulated = encode(wavy_levels(360))
    bits[184 * 50 : 184 * 52] ^= np.random.default_rng(0).integers(0, 2, 368, dtype=np.uint8)
    restored = restore(feed(bits))
    frame = restored.bit // FRAME_BITS
    np.testing.assert_array_equal(np.setdiff1d(np.arange(360), frame), [100, 101, 102, 103])
    np.testing.assert_array_equal(restored.gaps, [[99 * FRAME_BITS, 104 * FRAME_BITS]])
    np.testing.assert_array_equal(restored.values, modulated.levels[frame])


def test_a_run_too_short_for_its_level_has_none():
    bits, modulated = encode(wavy_levels(240))
    for block in (50, 52):
        bits[184 * block : 184 * (block + 1)] ^= 1
    restored = restore(feed(bits))
    frame = restored.bit // FRAME_BITS
    short = (frame == 102) | (frame == 103)
    assert short.sum() == 2
    known = np.isfinite(restored.values[short])
    assert known.sum(axis=1).tolist() == [1, 1]  # the pair that these two frames carry
    np.testing.assert_array_equal(
        restored.values[short][known], modulated.levels[frame][short][known]
    )
    assert np.isfinite(restored.values[~short]).all()


def test_a_frame_that_was_accepted_wrongly_is_contradicted_by_the_levels():
    bits, modulated = encode(wavy_levels(240))
    frames = feed(bits)
    frames.codes[120] = np.where(frames.codes[120] == 5, 4, 5)
    restored = restore(frames)
    assert restored.contradictions == 6
    wrong = np.isfinite(restored.values) & (restored.values != modulated.levels)
    assert not wrong.any()
    assert (np.isnan(restored.values).sum(axis=0) <= 11).all()  # pairs come every 12 frames


def test_noise_alone_gives_no_frame():
    bits = np.random.default_rng(3).integers(0, 2, 15_000, dtype=np.uint8)
    assert not feed(bits).accepted.any()


def test_lock_is_lost_and_found_again():
    bits, modulated = encode(wavy_levels(360))
    noise = np.random.default_rng(4).integers(0, 2, 3001, dtype=np.uint8)
    restored = restore(feed(np.concatenate([bits, noise, bits])))
    late = restored.bit >= len(bits) + 3001
    frame = (restored.bit[late] - len(bits) - 3001) // FRAME_BITS
    assert late.sum() > 300
    np.testing.assert_array_equal(restored.values[late], modulated.levels[frame])


def test_double_integration_keeps_more_than_six_bits():
    # A slow, wide motion: plain 6-bit samples of the same range against the delta codes.
    count = 2000
    time = np.arange(count) / 140
    exact = 2048 + 1500 * np.sin(2 * np.pi * 0.7 * time) + 0.3
    levels = np.repeat(np.rint(exact)[:, None], 6, axis=1).astype(np.int64)
    decoded = modulate(levels).levels[:, 0]
    six_bits = np.floor(levels[:, 0] / 64) * 64 + 32
    twice = lambda x: np.cumsum(np.cumsum(x - levels[:, 0]))  # noqa: E731
    delta_error, plain_error = np.abs(twice(decoded)).max(), np.abs(twice(six_bits)).max()
    # 6 bits resolve 64 of the 4096 levels: the delta codes' integral is as good as 9 bits'.
    assert delta_error < plain_error / 8


def test_running_sum_errs_by_no_more_than_one_rounding():
    levels = wavy_levels(500, swing=900)
    modulated = modulate(levels)
    assert not modulated.overloaded.any()
    error = np.cumsum(modulated.levels - levels, axis=0)
    allowed = 0.5 + 0.12 * np.abs(STEPS[modulated.codes + LARGEST])
    assert (np.abs(error) <= allowed).all()


def test_slow_levels_are_exact_and_rest_costs_nothing():
    levels = np.cumsum(np.random.default_rng(0).integers(-8, 9, (300, 6)), axis=0) + 2048
    modulated = modulate(levels)
    np.testing.assert_array_equal(modulated.levels, levels)
    np.testing.assert_array_equal(demodulate(modulated.codes), levels - levels[0])


def test_overload_is_flagged_and_recovers_without_overshoot():
    levels = np.full((60, 6), 600, np.int64)
    levels[20:] = 3600
    modulated = modulate(levels)
    assert modulated.overloaded[20:23].all()
    assert modulated.levels.max() <= 3600 + 110
    np.testing.assert_array_equal(modulated.levels[-1], levels[-1])
    bits, _ = encode(levels)
    restored = restore(feed(bits))
    np.testing.assert_array_equal(restored.overloaded[:60], np.abs(modulated.codes) == LARGEST)
    assert (restored.overloaded[:60] >= modulated.overloaded).all()


def test_sixteen_readings_resolve_more_than_one():
    rng = np.random.default_rng(0)
    scales = ConverterScales()
    values = rng.uniform(-0.5, 0.5, (4000, 6)) * 2000 * scales.per_level
    noise = rng.normal(0, 0.5, (4000, 16, 6)) * 4 * scales.per_level
    levels = accumulate(quantise(values[:, None] + noise, scales))
    decoded, saturated = physical(levels.astype(float), scales)
    error = (decoded - values) / scales.per_level
    assert abs(error.mean()) < 0.02
    assert error.std() < 0.65  # one reading alone: 4 / sqrt(12) = 1.15 and its noise of 2
    assert not saturated.any()


def test_saturated_levels_are_flagged():
    scales = ConverterScales()
    values = np.array([[1.0], [-1.0]]) * np.full((2, 6), 1.5) * 2048 * scales.per_level
    levels = accumulate(np.repeat(quantise(values, scales)[:, None], 16, axis=1))
    assert physical(levels.astype(float), scales)[1].all()


def test_wrong_number_of_readings_and_scale_are_refused():
    with pytest.raises(InputError, match="must be 16"):
        accumulate(np.zeros((3, 4, 6), np.int64))
    with pytest.raises(InputError, match="gyroscope full scale"):
        ConverterScales(gyroscope=0.0)

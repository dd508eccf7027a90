"""Offsets of sources from distances that are known."""

from __future__ import annotations

import numpy as np
import pytest
from calibration_rig import measured_distances

from mocap_jax.calibration import KnownDistance, calibrate_source_offsets, pair_readings
from mocap_jax.errors import InputError
from mocap_jax.recording import calibrated, with_calibration


def distances() -> list[KnownDistance]:
    recording, apart = measured_distances()
    return [
        KnownDistance(source, true, pair_readings(recording, source, board), board)
        for (source, board), true in apart.items()
    ]


def test_offsets_are_what_the_simulator_gave() -> None:
    recording, _ = measured_distances()
    found = calibrate_source_offsets(distances())
    assert len(found.distances) == 10
    for source, o in found.offsets.items():
        true = float(recording.truth.parameters[f"source_offset/{source.split('/')[1]}"])
        assert abs(true) > 0.003 and abs(o.offset - true) < min(4 * o.sigma, 6e-4)
    assert np.abs(found.left_out_error).mean() < 5e-4 < 3e-3 < np.abs(found.raw_error).mean()
    np.testing.assert_allclose(found.scatter, 0.0025, rtol=0.8)


def test_distances_are_corrected_and_read_back_as_they_were() -> None:
    recording, apart = measured_distances()
    found = calibrate_source_offsets(distances())
    corrected = with_calibration(recording, found.calibration)
    assert calibrated(corrected) is corrected
    ranges = corrected.ranges
    for (source, board), true in apart.items():
        one = np.asarray(ranges.source) == ranges.source_names.index(source)
        one &= np.asarray(ranges.receiver) == ranges.receiver_names.index(board)
        assert np.median(np.asarray(ranges.distance)[one]) == pytest.approx(true, abs=1.5e-3)
        np.testing.assert_allclose(
            pair_readings(corrected, source, board), pair_readings(recording, source, board),
            rtol=0, atol=1e-15,
        )  # fmt: skip


def test_gross_errors_among_readings_do_no_harm_and_each_distance_counts_once() -> None:
    readings = np.full(50, 0.51)
    readings[:20] += 1.0
    many = KnownDistance("a", 0.5, readings)
    few = KnownDistance("a", 0.9, np.array([np.nan, 0.93]))
    found = calibrate_source_offsets([many, few, KnownDistance("b", 1.0, np.array([1.0]))])
    assert found.offsets["a"].offset == pytest.approx(0.02)
    assert found.offsets["a"].sigma == pytest.approx(0.01)
    assert found.offsets["b"].sigma == 0
    np.testing.assert_allclose(found.raw_error, [0.01, 0.03, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.left_out_error, [-0.02, 0.02, np.nan], atol=1e-12)


def test_a_distance_that_failed_is_left_out_and_said_so() -> None:
    random = np.random.default_rng(0)
    true = np.linspace(0.3, 0.9, 7)
    excess = {"a": 0.02, "b": -0.01}
    readings = {
        (source, d): d + offset + 0.001 * random.standard_normal(30)
        for source, offset in excess.items()
        for d in true
    }
    readings["b", true[2]] += 0.06
    found = calibrate_source_offsets([KnownDistance(s, d, x) for (s, d), x in readings.items()])
    bad = [d for d, failed in zip(found.distances, found.failed, strict=True) if failed]
    assert [(d.source, d.true) for d in bad] == [("b", true[2])]
    for source, offset in excess.items():
        assert found.offsets[source].offset == pytest.approx(offset, abs=2e-3)
    # Its own error is stated all the same, and does not spoil those of the others.
    assert found.left_out_error[found.failed] == pytest.approx([0.06], abs=2e-3)
    assert np.abs(found.left_out_error[~found.failed]).max() < 2e-3


def test_sources_that_scatter_are_not_pruned() -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        distances = [
            KnownDistance("a", d, d + 0.03 * random.standard_normal(1))
            for d in (0.3, 0.5, 0.7, 0.9)
        ]
        found = calibrate_source_offsets(distances)
        assert not found.failed.any()
        errors = [d.measured[0] - d.true for d in distances]
        assert found.offsets["a"].offset == pytest.approx(np.mean(errors))
        expected = [e - (sum(errors) - e) / 3 for e in errors]
        np.testing.assert_allclose(found.left_out_error, expected, atol=1e-12)


def test_wrong_input_is_named() -> None:
    recording, _ = measured_distances()
    with pytest.raises(InputError, match="unknown source 'middle'; valid: source/left"):
        pair_readings(recording, "middle", "board0")
    with pytest.raises(InputError, match="unknown receiver 'bord0'; valid: board0"):
        pair_readings(recording, "left", "bord0")
    with pytest.raises(InputError, match="none of 1 distances has a reading"):
        calibrate_source_offsets([KnownDistance("a", 1.0, np.array([np.nan]))])
    with pytest.raises(InputError, match="'a': true distance -1.0 m is not above zero"):
        calibrate_source_offsets([KnownDistance("a", -1.0, np.array([1.0]))])

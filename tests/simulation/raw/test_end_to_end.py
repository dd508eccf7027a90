"""Motion to wires to file to measurements, against the truth of the direct simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mocap_jax.decoding import AirOptions, decode_raw
from mocap_jax.errors import InputError
from mocap_jax.io import read_recording
from mocap_jax.signals.ultrasonic.arrivals import DetectorOptions
from mocap_jax.simulation import SimulationOptions, simulate
from mocap_jax.simulation.raw import RawOptions, simulate_raw

OPTIONS = SimulationOptions(rest_s=0.3, blend_s=0.5)


@pytest.fixture(scope="module")
def ideal(motion, suit, tmp_path_factory):
    raw = simulate_raw(motion, profile="ideal", suit=suit, options=OPTIONS)
    path = tmp_path_factory.mktemp("raw") / "ideal.raw.mcap"
    raw.write(path)
    return raw, path


@pytest.mark.parametrize(("detector", "largest"), [("matched", 0.0003), ("inflection", 0.001)])
def test_ideal_distances_are_those_of_the_direct_simulation(
    motion, suit, ideal, detector: str, largest: float
):
    raw, path = ideal
    direct = simulate(motion, profile="ideal", suit=suit, options=OPTIONS).ranges
    found = decode_raw(path, DetectorOptions(detector=detector)).recording.ranges
    true = {
        (round(t / 0.008), r): d
        for t, r, d in zip(
            np.asarray(direct.time), np.asarray(direct.receiver), np.asarray(direct.distance),
            strict=True,
        )
    }  # fmt: skip
    own = zip(
        np.asarray(found.time), np.asarray(found.receiver), np.asarray(found.distance), strict=True
    )
    errors = np.array([d - true[k] for t, r, d in own if (k := (round(t / 0.008), r)) in true])
    assert len(errors) > 50
    assert np.sqrt(np.mean(errors**2)) < largest
    assert found.source_names == direct.source_names


def test_inertial_readings_are_the_boards_own(ideal):
    raw, path = ideal
    decoded = decode_raw(path)
    for name, board in zip(raw.wires, raw.boards, strict=True):
        stream = decoded.recording.inertial[name]
        time = np.asarray(stream.time)
        frame = np.rint((time - board.start) / board.period - 0.5).astype(int)
        np.testing.assert_allclose(time, board.start + (frame + 0.5) * board.period, atol=5e-6)
        force = np.asarray(stream.accelerometer)
        known = np.isfinite(force).all(axis=1)
        assert known.sum() > 0.9 * len(board.levels)
        error = (force - board.exact[frame, 3:])[known]
        assert np.abs(error.mean(axis=0)).max() < 0.01
        assert decoded.boards[name].lost == 0


def test_missing_samples_are_a_gap_in_everything(ideal, tmp_path):
    raw, _ = ideal
    path = tmp_path / "gap.raw.mcap"
    pieces = [p for i, p in enumerate(raw.chunks()) if i != 4]  # 2.0 s to 2.5 s
    raw.write(path, pieces)
    decoded = decode_raw(path)
    recording = decoded.recording
    assert {(g.wire, round(g.start, 4), round(g.end, 4)) for g in decoded.gaps} == {
        (name, 2.0, 2.5) for name in raw.wires
    }
    times = np.concatenate([np.asarray(recording.ranges.time)])
    assert not ((times > 2.0) & (times < 2.5)).any()
    assert (times < 2.0).any() and (times > 2.5).any()
    inertial = np.asarray(recording.inertial["base"].time)
    assert not ((inertial > 2.0) & (inertial < 2.48)).any()
    assert (inertial > 2.6).sum() > 100


def test_pulses_that_are_not_named_are_missed_and_counted(ideal, tmp_path):
    raw, _ = ideal
    path, kept = tmp_path / "pulses.raw.mcap", np.ones(len(raw.pulse_time), bool)
    kept[[20, 21, 50]] = False
    fewer = replace(raw, pulse_time=raw.pulse_time[kept], pulse_source=raw.pulse_source[kept])
    fewer.write(path)
    decoded = decode_raw(path)
    assert decoded.missing_pulses == 3
    ranges = decoded.recording.ranges
    assert not np.isin(np.rint(np.asarray(ranges.time) / 0.008), np.flatnonzero(~kept)).any()
    pulse = np.searchsorted(raw.pulse_time, np.asarray(ranges.time) - 1e-6)
    error = np.asarray(ranges.distance) - raw.distance[pulse, np.asarray(ranges.receiver)]
    assert np.abs(error).max() < 0.002


def test_samples_out_of_order_are_refused(ideal, tmp_path):
    raw, _ = ideal
    pieces = list(raw.chunks())
    raw.write(tmp_path / "order.raw.mcap", [*pieces[:3], pieces[1], *pieces[3:]])
    with pytest.raises(InputError, match=r"order\.raw\.mcap: /acoustic/base: samples of 0\.5"):
        decode_raw(tmp_path / "order.raw.mcap")


@pytest.mark.parametrize("detector", ["matched", "inflection"])
def test_a_tone_beside_the_band_does_no_harm(motion, suit, tmp_path, detector: str):
    """33 kHz, 20 dB over the ambient noise: nothing is missed, and no distance is worse."""
    raw = simulate_raw(
        motion, profile="paper", suit=suit, options=OPTIONS, raw=RawOptions(interference=600.0)
    )
    raw.write(tmp_path / "tone.raw.mcap")
    ranges = decode_raw(
        tmp_path / "tone.raw.mcap", DetectorOptions(detector=detector)
    ).recording.ranges
    pulse = np.searchsorted(raw.pulse_time, np.asarray(ranges.time) - 1e-6)
    receiver = np.asarray(ranges.receiver)
    trusted = (np.asarray(ranges.confidence) > 0.5) & raw.visible[pulse, receiver]
    error = (np.asarray(ranges.distance) - raw.distance[pulse, receiver])[trusted]
    assert trusted.sum() > 0.95 * raw.visible.sum()
    assert np.sqrt(np.mean(error**2)) < 0.003 and np.abs(error).max() < 0.015


def test_warm_and_humid_air_makes_distances_longer(ideal):
    """The recorded temperature is that of 343 m/s in dry air."""
    _, path = ideal
    base, humid, warm = (
        decode_raw(path, air=air).recording
        for air in (None, AirOptions(humidity=80.0), AirOptions(celsius=30.0))
    )
    assert base.setup.speed_of_sound == pytest.approx(343.0)
    assert humid.setup.speed_of_sound == pytest.approx(344.0, abs=0.1)
    assert humid.setup.provenance["air_humidity"] == 80.0
    share = np.asarray(warm.ranges.distance) / np.asarray(base.ranges.distance)
    np.testing.assert_allclose(share, 20.05 * np.sqrt(303.15) / 343.0, rtol=1e-6)
    with pytest.raises(InputError, match="humidity 120: valid are 0 to 100"):
        AirOptions(humidity=120.0)


def test_truncated_file_gives_its_beginning_and_says_so(ideal, tmp_path):
    _, whole = ideal
    path = tmp_path / "cut.raw.mcap"
    data = whole.read_bytes()
    path.write_bytes(data[: int(0.6 * len(data))])
    recording = decode_raw(path).recording
    assert recording.salvage
    full = decode_raw(whole).recording
    assert 0.3 * len(full.ranges.time) < len(recording.ranges.time) < len(full.ranges.time)


def test_field_profile_decodes_within_its_errors(motion, suit, tmp_path):
    raw = simulate_raw(motion, profile="field", suit=suit, seed=3, options=OPTIONS)
    raw.write(tmp_path / "field.raw.mcap")
    decoded = decode_raw(tmp_path / "field.raw.mcap")
    ranges = decoded.recording.ranges
    pulse = np.rint(np.asarray(ranges.time) / 0.008).astype(int)
    receiver = np.asarray(ranges.receiver)
    error = np.asarray(ranges.distance) - raw.distance[pulse, receiver]
    trusted = (np.asarray(ranges.confidence) > 0.5) & raw.visible[pulse, receiver]
    assert trusted.sum() > 20
    assert np.median(np.abs(error[trusted])) < 0.012
    assert all(b.frames > 0.95 * len(own.levels) for b, own in zip(
        decoded.boards.values(), raw.boards, strict=True))  # fmt: skip


def test_same_seed_same_samples_and_truth_of_the_direct_simulation(motion, suit):
    one = simulate_raw(motion, profile="field", suit=suit, seed=5, options=OPTIONS)
    two = simulate_raw(motion, profile="field", suit=suit, seed=5, options=OPTIONS)
    direct = simulate(motion, profile="field", suit=suit, seed=5, options=OPTIONS)
    np.testing.assert_array_equal(next(one.chunks())[1], next(two.chunks())[1])
    assert one.recording.truth.body_xml == direct.truth.body_xml
    for name in ("speed_of_sound", "source_offset/front", "gyroscope_bias/lower"):
        assert float(np.sum(one.recording.truth.parameters[name])) == float(
            np.sum(direct.truth.parameters[name])
        )


def test_raw_recordings_are_refused_elsewhere_and_recordings_here(ideal, motion, suit, tmp_path):
    from mocap_jax.io import write_recording

    with pytest.raises(InputError, match="mocap-jax decode"):
        read_recording(ideal[1])
    path = tmp_path / "direct.mcap"
    write_recording(path, simulate(motion, profile="ideal", suit=suit, options=OPTIONS))
    with pytest.raises(InputError, match="not a raw recording"):
        decode_raw(path)
    with pytest.raises(InputError, match="no ultrasonic sources"):
        simulate_raw(motion, suit=replace(suit, sources=()))

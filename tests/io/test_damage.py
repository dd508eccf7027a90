"""Damaged files give what is sound of them, or one sentence; never another exception."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from io_samples import random_recording, random_solution

from mocap_jax.errors import InputError
from mocap_jax.io import (
    describe,
    read_recording,
    read_solution,
    validate_recording,
    write_recording,
    write_solution,
)
from mocap_jax.recording import Recording, RestHold


@pytest.fixture(scope="module")
def raw(tmp_path_factory, body) -> bytes:
    path = tmp_path_factory.mktemp("damage") / "a.mcap"
    write_recording(path, random_recording(body, n=1500))
    return path.read_bytes()


@pytest.fixture(scope="module")
def short(tmp_path_factory, body) -> bytes:
    path = tmp_path_factory.mktemp("damage") / "a.mcap"
    write_recording(path, random_recording(body, n=60))
    return path.read_bytes()


def read_damaged(folder, raw: bytes) -> Recording | None:
    """What is salvaged; None when the file was refused in one line that names it."""
    path = folder / "damaged.mcap"
    path.write_bytes(raw)
    try:
        recording = read_recording(path)
    except InputError as error:
        assert "damaged.mcap" in str(error) and "\n" not in str(error)
        return None
    assert "damaged.mcap" in describe(path)
    return recording


@pytest.mark.parametrize("part", [0.05, 0.3, 0.5, 0.8, 0.95, 0.999])
def test_truncated(tmp_path, raw, part) -> None:
    recording = read_damaged(tmp_path, raw[: int(part * len(raw))])
    assert recording is not None and any("ends early" in s for s in recording.salvage)
    # Body and set-up stand first, so they are always there.
    assert recording.body_xml is not None and recording.setup.sensors
    if part >= 0.3:
        validate_recording(recording)
        kept = recording.interval[1] / (1500 / 140)
        assert part - 0.25 < kept < part + 0.25


def test_truncated_anywhere_never_raises_anything_else(tmp_path, short) -> None:
    head = range(0, 4000, 97)
    for at in [*head, *np.linspace(4000, len(short) - 1, 50).astype(int)]:
        recording = read_damaged(tmp_path, short[:at])
        assert recording is None or recording.salvage


def test_what_is_salvaged_is_true(tmp_path, body, raw) -> None:
    recording = read_damaged(tmp_path, raw[: len(raw) // 2])
    original = random_recording(body, n=1500)
    n = len(recording.inertial["pelvis"].time)
    np.testing.assert_array_equal(
        recording.inertial["pelvis"].gyroscope, original.inertial["pelvis"].gyroscope[:n]
    )


def test_flipped_bytes(tmp_path, short) -> None:
    rng = np.random.default_rng(1)
    for count in [1] * 60 + [30] * 20:
        damaged = bytearray(short)
        for at in rng.integers(8, len(short), count):
            damaged[at] ^= 1 << int(rng.integers(8))
        read_damaged(tmp_path, bytes(damaged))


def test_a_flipped_byte_in_a_chunk_costs_that_chunk_only(tmp_path, raw) -> None:
    damaged = bytearray(raw)
    damaged[len(raw) // 2] ^= 0x10
    recording = read_damaged(tmp_path, bytes(damaged))
    assert any("messages are lost" in text for text in recording.salvage)
    assert 700 < len(recording.inertial["pelvis"].time) < 1500


def test_data_section_is_guarded_outside_of_chunks(tmp_path, raw) -> None:
    at = raw.index("S. Übung".encode())  # In the metadata, which have no checksum of their own.
    recording = read_damaged(tmp_path, raw[:at] + b"T" + raw[at + 1 :])
    assert recording.salvage == ("checksum of the data differs: some bytes were changed",)


def test_lost_body_is_said(tmp_path, raw) -> None:
    at = raw.index(b"<mujoco>")
    recording = read_damaged(tmp_path, raw[:at] + b"?" + raw[at + 1 :])
    assert recording.body_xml is None
    assert any("body.xml" in text for text in recording.salvage)
    with pytest.raises(InputError, match="no body model"):
        validate_recording(recording)


@pytest.mark.parametrize("content", [
    b"", b"hello", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + b"\xff" * 100,
    b"\x89MCAP0\r\n" + b"\x00" * 1000, np.random.default_rng(0).bytes(5000),
    b"\x89MCAP0\r\n" + np.random.default_rng(1).bytes(5000), b"PK\x03\x04" + b"\0" * 64,
])  # fmt: skip
def test_garbage(tmp_path, content) -> None:
    assert read_damaged(tmp_path, content) is None
    with pytest.raises(InputError, match="damaged.mcap"):
        describe(tmp_path / "damaged.mcap")
    with pytest.raises(InputError, match="damaged.mcap"):
        read_solution(tmp_path / "damaged.mcap")


def test_missing_file_and_folder(tmp_path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_recording(tmp_path / "none.mcap")
    with pytest.raises(InputError, match="cannot read"):
        read_recording(tmp_path)


def test_damaged_solutions(tmp_path, body) -> None:
    path = tmp_path / "a.mcap"
    write_solution(path, random_solution(body, n=400))
    raw, rng = path.read_bytes(), np.random.default_rng(2)
    cut = [raw[:at] for at in np.linspace(0, len(raw) - 1, 60).astype(int)]
    for damaged in cut + [_flip(raw, rng) for _ in range(80)]:
        path.write_bytes(damaged)
        try:
            solution = read_solution(path)
        except InputError as error:
            assert "a.mcap" in str(error) and "\n" not in str(error)
            continue
        assert len(solution.trajectory.time) == len(solution.trajectory.q)
        if len(damaged) < len(raw):
            assert any("Salvaged" in text for text in solution.remarks)
            assert len(solution.covariance) == len(solution.trajectory.q)


def _flip(raw: bytes, rng: np.random.Generator) -> bytes:
    damaged = bytearray(raw)
    damaged[int(rng.integers(8, len(raw)))] ^= 1 << int(rng.integers(8))
    return bytes(damaged)


def test_kinds_are_not_mixed_up(tmp_path, body) -> None:
    write_solution(tmp_path / "s.mcap", random_solution(body))
    write_recording(tmp_path / "r.mcap", random_recording(body, n=20))
    with pytest.raises(InputError, match="r.mcap: this is a recording"):
        read_solution(tmp_path / "r.mcap")
    with pytest.raises(InputError, match="s.mcap: this is a solution"):
        read_recording(tmp_path / "s.mcap")


def test_newer_format_is_refused(tmp_path, body, monkeypatch) -> None:
    monkeypatch.setattr("mocap_jax.io.mcap_write.FORMAT_VERSION", 99)
    write_recording(tmp_path / "r.mcap", random_recording(body, n=20))
    with pytest.raises(InputError, match="format version 99"):
        read_recording(tmp_path / "r.mcap")


def test_a_body_that_was_never_there_is_not_lost(tmp_path, body) -> None:
    path = tmp_path / "plain.mcap"
    plain = dataclasses.replace(random_recording(body, n=300), body_xml=None, truth=None)
    write_recording(path, plain)
    content = path.read_bytes()
    recording = read_damaged(tmp_path, content[: int(0.7 * len(content))])
    assert recording.salvage and not any("body" in text for text in recording.salvage)


def test_a_rest_hold_that_is_lost_is_dropped_and_said(tmp_path, body) -> None:
    path = tmp_path / "late.mcap"
    whole = random_recording(body, n=1500)
    held = dataclasses.replace(whole.setup, rest=RestHold(9.0, 10.0))
    write_recording(path, dataclasses.replace(whole, setup=held))
    content = path.read_bytes()
    assert read_recording(path).setup.rest == RestHold(9.0, 10.0)
    recording = read_damaged(tmp_path, content[: len(content) // 2])
    assert recording.setup.rest is None
    assert any("rest hold (9 to 10 s) is lost" in text for text in recording.salvage)
    validate_recording(recording)

"""Solutions come back whole."""

from __future__ import annotations

import dataclasses
import json

import jax
import numpy as np
import pytest
from io_samples import START, random_recording, random_solution
from mcap.reader import make_reader

from mocap_jax.errors import InputError
from mocap_jax.io import describe, mcap_covariance, read_solution, write_recording, write_solution
from mocap_jax.solution import Solution, Status
from mocap_jax.trajectory import Trajectory


def assert_same(a: Solution, b: Solution) -> None:
    np.testing.assert_allclose(a.trajectory.time, b.trajectory.time, atol=1e-9)
    for x, y in ((a.trajectory.q, b.trajectory.q), (a.trajectory.v, b.trajectory.v),
                 (a.covariance, b.covariance), (a.pair_covariance, b.pair_covariance)):  # fmt: skip
        assert (x is None) == (y is None)
        np.testing.assert_array_equal(np.asarray(x), np.asarray(y))
    for x, y in zip(jax.tree.leaves(a.body), jax.tree.leaves(b.body), strict=True):
        np.testing.assert_array_equal(x, y)
    assert a.body.xml == b.body.xml
    for name in ("calibration", "calibration_std"):
        np.testing.assert_equal(getattr(b, name), getattr(a, name))
    plain = {f.name for f in dataclasses.fields(Solution)} - {
        "trajectory", "covariance", "pair_covariance", "body", "calibration", "calibration_std"
    }  # fmt: skip
    for name in plain:
        np.testing.assert_equal(getattr(b, name), getattr(a, name), err_msg=name)


def test_round_trip(tmp_path, body) -> None:
    solution = random_solution(body)
    write_solution(tmp_path / "s.mcap", solution)
    assert_same(solution, read_solution(tmp_path / "s.mcap"))


def test_covariances_of_neighbours_survive(tmp_path, body) -> None:
    solution = with_pairs(random_solution(body))
    write_solution(tmp_path / "s.mcap", solution)
    assert_same(solution, read_solution(tmp_path / "s.mcap"))
    assert "covariance: every frame, and neighbours" in describe(tmp_path / "s.mcap")


def with_pairs(solution: Solution) -> Solution:
    covariance = np.asarray(solution.covariance)
    pairs = covariance[1:] @ covariance[:-1]  # any matrices that are not symmetric
    return dataclasses.replace(solution, pair_covariance=pairs)


def test_incomplete_neighbours_are_left_out_and_named(tmp_path, body, monkeypatch) -> None:
    solution = with_pairs(random_solution(body))
    whole = mcap_covariance.pb.encode_pair_covariances
    monkeypatch.setattr(
        mcap_covariance.pb, "encode_pair_covariances",
        lambda stamps, pairs: [whole(stamps, pairs)[0]] * len(pairs),
    )  # fmt: skip
    write_solution(tmp_path / "s.mcap", solution)
    found = read_solution(tmp_path / "s.mcap")
    assert found.pair_covariance is None and found.covariance is not None
    assert any("neighbouring poses are incomplete" in r for r in found.remarks)


def test_estimated_body_arrays_survive(tmp_path, body) -> None:
    changed = body.replace(site_pos=body.site_pos + 0.01, body_pos=body.body_pos * 1.1)
    solution = dataclasses.replace(random_solution(body), body=changed)
    write_solution(tmp_path / "s.mcap", solution)
    assert_same(solution, read_solution(tmp_path / "s.mcap"))


@pytest.mark.parametrize("status", list(Status))
def test_bare_solutions_of_any_status(tmp_path, body, status) -> None:
    full = random_solution(body)
    q = full.trajectory.q.copy()
    if not status.ok:
        q[5:] = np.nan
    solution = Solution(Trajectory(full.trajectory.time, q), body, status, "ekf", full.setup)
    write_solution(tmp_path / "s.mcap", solution)
    assert_same(solution, read_solution(tmp_path / "s.mcap"))
    assert status.value in describe(tmp_path / "s.mcap")


def test_absolute_start_is_kept(tmp_path, body) -> None:
    solution = random_solution(body)
    setup = dataclasses.replace(solution.setup, provenance={"start_utc_ns": START})
    solution = dataclasses.replace(solution, setup=setup)
    write_solution(tmp_path / "s.mcap", solution)
    assert_same(solution, read_solution(tmp_path / "s.mcap"))
    with open(tmp_path / "s.mcap", "rb") as stream:
        first = make_reader(stream).get_summary().statistics.message_start_time
    assert first == START + 1_250_000_000


def test_summary_is_strict_json(tmp_path, body) -> None:
    write_solution(tmp_path / "s.mcap", random_solution(body))
    with open(tmp_path / "s.mcap", "rb") as stream:
        found = {a.name: a.data for a in make_reader(stream).iter_attachments()}

    def refuse(text: str) -> float:
        raise ValueError(text)

    summary = json.loads(found["solution.json"], parse_constant=refuse)
    assert summary["status"] == "UNDETERMINED" and summary["status_text"].startswith("Converged")


def test_shapes_must_fit(tmp_path, body) -> None:
    solution = random_solution(body)
    wrong = dataclasses.replace(solution, covariance=solution.covariance[:3])
    with pytest.raises(InputError, match="covariance of shape"):
        write_solution(tmp_path / "s.mcap", wrong)
    wrong = dataclasses.replace(solution, pair_covariance=solution.covariance)
    with pytest.raises(InputError, match="pair covariance of shape .* neighbouring poses"):
        write_solution(tmp_path / "s.mcap", wrong)
    assert not list(tmp_path.iterdir())


def test_descriptions(tmp_path, body, shared_data) -> None:
    write_recording(tmp_path / "r.mcap", random_recording(body, n=100))
    text = describe(tmp_path / "r.mcap")
    for part in (
        "kind: recording", "S. Übung", "pelvis: 100 samples at 140.0 Hz", "200 distances",
        "truth: 100 poses", "12 degrees of freedom", "mocap_jax ",
    ):  # fmt: skip
        assert part in text
    (tmp_path / "b.xml").write_text(body.xml)
    assert "5 segments (root Pelvis)" in describe(tmp_path / "b.xml")
    assert "173 frames" in describe(shared_data / "cmu_mocap" / "02_03.amc")
    with pytest.raises(InputError, match=r"unknown kind of file '\.doc'; valid: \.mcap"):
        (tmp_path / "a.doc").touch()
        describe(tmp_path / "a.doc")

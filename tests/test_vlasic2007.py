"""`scripts/reproduce_vlasic2007`: stored cells, pooled rows and tables, without any estimate."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from estimate_store import Store
from vlasic2007 import cells
from vlasic2007.cells import Cell
from vlasic2007.chain import recorded
from vlasic2007.checks import check_lines
from vlasic2007.paper import COMBINATIONS, JOINTS, mean_of_joints
from vlasic2007.results import Results
from vlasic2007.scores import _moments
from vlasic2007.tables import markdown, text
from vlasic2007.treadmill import Shoulder, keep, read, walking_in_place

from mocap_jax.motion import Motion
from mocap_jax.trajectory import Trajectory

CELL = Cell("clips/02_01.amc", "field", 3, "A+G+D", "ekf", None)
SECTION = ("02_01", "field")


def scores(values: np.ndarray, observed: float = 2.0) -> dict:
    moments = {"folded": _moments(values), "unfolded": _moments(2 * values)}
    return {
        "frames": len(values), "seconds_solve": 0.5,
        "orientation_error_mean_deg": {"mean_observed": observed},
        "table1": dict.fromkeys(JOINTS, moments),
    }  # fmt: skip


def some(method: str, combination: str, seed: int) -> Cell:
    return dataclasses.replace(CELL, method=method, combination=combination, seed=seed)


def test_store_keeps_each_cell_apart(tmp_path: Path):
    store = Store(tmp_path)
    others = [
        dataclasses.replace(CELL, **change)
        for change in (
            {"motion": "clips/02_03.amc"}, {"profile": "paper"}, {"seed": 4}, {"cut": 5.0},
            {"combination": "A+G"}, {"method": "optimise"}, {"chain": "wired"}, {"chain": "raw"},
        )
    ]  # fmt: skip
    store.write(CELL, {"frames": 7})
    assert store.has(CELL) and not any(store.has(cell) for cell in others)
    assert [(cell, s["frames"]) for cell, s in store.read([CELL, *others])] == [(CELL, 7)]
    assert not [f for f in tmp_path.rglob("*") if f.is_file() and f.suffix != ".json"]


def test_cells_of_another_version_are_read_only_if_wanted(tmp_path, monkeypatch):
    store = Store(tmp_path)
    store.write(CELL, {"frames": 7})
    monkeypatch.setattr(cells, "code_version", lambda method: "another")
    assert not store.has(CELL) and not list(store.read([CELL]))
    assert [s["frames"] for _, s in store.read([CELL], any_version=True)] == [7]


def test_code_without_its_comments_and_docstrings(tmp_path: Path):
    versions = []
    for source in (
        'def f(x):\n    """Text."""\n    return x\n', "def f(x):  # why\n    return x\n",
        "def f(x):\n    return x + 1\n",
    ):  # fmt: skip
        file = tmp_path / "module.py"
        file.write_text(source, encoding="utf-8")
        versions.append(cells._code_of(file))
    assert versions[0] == versions[1] != versions[2]


def test_rows_pool_frames_of_all_seeds():
    rng = np.random.default_rng(0)
    one, two = rng.uniform(0, 9, 40), rng.uniform(5, 30, 100)
    found = [(some("ekf", "A", 0), scores(one, 2.0)), (some("ekf", "A", 1), scores(two, 4.0))]
    row = Results(found, 2).row(SECTION, "A", "ekf")
    together = np.concatenate([one, two])
    assert row.folded[0] == pytest.approx((together.mean(), together.std()))
    assert row.unfolded[2] == pytest.approx((2 * together.mean(), 2 * together.std()))
    assert (row.mean, row.observed) == (pytest.approx(together.mean()), 3.0)
    assert row.frames_per_second == pytest.approx(140)


def test_ratios_are_of_the_seeds_that_both_rows_have():
    found = [(some("smoothed", "A+G", s), scores(np.ones(5), 2.0)) for s in (0, 1)]
    found += [(some("optimise", "A+G", s), scores(np.ones(5), 1.0 + 9 * s)) for s in (1, 2)]
    results = Results(found, 99)
    one, other = results.pair(SECTION, ("A+G", "optimise"), ("A+G", "smoothed"))
    assert one.seeds == other.seeds == {1}
    assert any("5.000" in line and "A+G, optimiser / smoothed" in line
               for line in check_lines(results))  # fmt: skip


def test_waveforms_stand_beside_direct_measurements():
    found = []
    for chain, seed, value in (("wired", 0, 2.0), ("raw", 0, 2.1), ("raw", 1, 9.0)):
        cell = dataclasses.replace(CELL, chain=chain, seed=seed)
        found.append((cell, scores(np.full(5, value), 2 * value)))
    results = Results(found, 3)
    assert results.sections == [("02_01", "field, wired"), ("02_01", "field, from waveforms")]
    lines = [line for line in check_lines(results) if "from waveforms / direct" in line]
    assert len(lines) == 2 and all("1.050" in line and "<= 1.1" in line for line in lines)


def test_the_wires_bring_what_was_simulated_directly(nodding_body):
    """Two segments that hold still; the same person, pose and errors on either way."""
    time = np.arange(90) / 60
    path = Trajectory(time, np.tile(np.asarray(nodding_body.qpos0), (len(time), 1)))
    cell = dataclasses.replace(CELL, motion="routine", seed=2)
    motion = Motion("nod", nodding_body, path)
    direct, raw = (
        recorded(motion, dataclasses.replace(cell, chain=chain)) for chain in ("wired", "raw")
    )
    assert raw.inertial.keys() == direct.inertial.keys()
    assert raw.setup.noise == direct.setup.noise  # with the round-off of telemetry
    assert raw.setup.provenance["decoded"] and raw.truth.body_xml == direct.truth.body_xml
    for name, stream in raw.inertial.items():
        mean, other = (np.nanmean(np.asarray(s.accelerometer), axis=0)
                       for s in (stream, direct.inertial[name]))  # fmt: skip
        np.testing.assert_allclose(mean, other, atol=0.02)
    assert "decoded" not in direct.setup.provenance


def test_tables_stand_beside_the_paper_and_count_failures():
    failed = {"frames": 5, "status": "DIVERGED"}
    found = [(some("ekf", c, 0), scores(np.full(5, 12.34))) for c in COMBINATIONS]
    found.append((some("optimise", "A", 0), failed))
    results = Results(found, 70)
    for page in (text(results), markdown(results, check_lines(results))):
        assert "8 of 70 estimates" in page and "1 (1 failed)" in page
        assert "159.7 ± 147.7" in page and "12.3 ± 0" in page and "24.7 ± 0" in page
        assert page.index("A+D ") < page.index("G+D ") < page.index("A+G+D ")


def test_the_paper_says_that_all_three_are_best():
    assert min(COMBINATIONS, key=mean_of_joints) == "A+G+D"


def test_treadmill_walking_repeats_in_place():
    path = walking_in_place(12.0).trajectory
    q, period = np.asarray(path.q), 636
    np.testing.assert_allclose(q[period:], q[:-period], atol=1e-6)
    assert np.ptp(q[:, 0]) < 0.01 and len(q) == 1441
    assert np.abs(np.diff(q, axis=0)).max() < 0.2


def test_drift_of_a_steady_turn(tmp_path: Path):
    time = 3.0 + np.arange(601) / 10
    error = np.stack([0 * time, np.ones_like(time), 0.05 * (time - 3.0)], axis=1)
    zero = np.zeros((601, 3))
    keep(Shoulder(time, ("a", "b"), zero, zero, error, zero, zero), tmp_path / "kept.npz")
    one = read(tmp_path / "kept.npz")
    assert one.names == ("a", "b")
    assert one.drift() == pytest.approx(3.0) and one.drift(0, 10) == pytest.approx(3.0)
    assert one.mean_error(0, 0) == pytest.approx(1.0)

"""Statistics by sensor and source-receiver pair, against sums written out in NumPy."""

from types import SimpleNamespace

import numpy as np
import pytest

from mocap_jax.estimate.innovation_statistics import InnovationStatistics
from mocap_jax.estimate.sequence.statistics import residual_statistics
from mocap_jax.kalman import Innovation

T, K, GATE, SIGMA = 40, 3, 4.0, 0.01
SITES = ("pelvis", "hand", "source/belly")
BODY = SimpleNamespace(topology=SimpleNamespace(site_names=SITES))


@pytest.fixture(scope="module")
def ranges():
    """Residuals (measured minus predicted), weights, receivers, and which are behind."""
    random = np.random.default_rng(5)
    residual = SIGMA * random.standard_normal((T, K)) + 0.02
    residual[::7] += 1.0
    weight = random.uniform(0.3, 1.0, (T, K)) * (random.random((T, K)) < 0.8)
    receiver = random.integers(0, 2, (T, K))
    return residual, weight, receiver, random.random((T, K)) < 0.25


def expected(residual, deviation):
    whitened, info = residual / deviation, 1 / deviation**2
    return {
        "rms": np.sqrt((whitened**2).mean()),
        "bias": whitened.mean(),
        "bias_units": (residual * info).sum() / info.sum(),
        "rms_units": np.sqrt((residual**2 * info).sum() / info.sum()),
        "outliers": (np.abs(whitened) > 3).mean(),
    }


def test_innovations_of_pairs(ranges):
    residual, weight, receiver, behind = ranges
    data = SimpleNamespace(sensors=("pelvis", "hand"), sites=(0, 1))
    statistics = InnovationStatistics(data, BODY, (0, 1, 2), GATE)
    active = (weight > 0) & ~behind
    deviation = SIGMA / np.where(weight > 0, weight, 1.0)
    plain = np.where(active, residual, 0.0)
    nis = ((plain / deviation) ** 2).sum(axis=1)
    for half in (slice(0, T // 2), slice(T // 2, T)):
        n = len(weight[half])
        frames = SimpleNamespace(
            valid=np.ones(n, bool), range_weight=weight[half], range_receiver=receiver[half],
            range_source=np.full((n, K), 2),
        )  # fmt: skip
        innovation = Innovation(
            plain[half], plain[half] / deviation[half], nis[half], np.zeros(n), np.ones(n, bool)
        )
        assert statistics.add(frames, {"D": innovation}) == 0
    found = statistics.normalised
    assert found.keys() == {"range"} and found["range"]["count"] == active.sum()
    assert found["range"]["squared"] == pytest.approx(nis.sum())
    table = statistics.table()
    for r, name in enumerate(("pelvis", "hand")):
        row, mine = table[f"range/belly-{name}"], receiver == r
        heard, used = mine & (weight > 0), mine & active
        assert row["heard"] == heard.sum() and row["count"] == used.sum()
        assert row["rejected"] == pytest.approx(1 - used.sum() / heard.sum())
        for key, value in expected(residual[used], deviation[used]).items():
            assert row[key] == pytest.approx(value), key
        # Half of the weight is lost where (whitened / gate)^4 exceeds 2.
        halved = (np.abs(residual[used] / deviation[used]) / GATE) ** 4 > 2
        assert row["lowered"] == pytest.approx(halved.mean()) and 0 < row["lowered"] < 1


def test_residuals_of_pairs_and_sensors(ranges):
    residual, weight, receiver, behind = ranges
    info = np.where(behind, 0.0, weight**2 / SIGMA**2)
    data = SimpleNamespace(sensors=("pelvis", "hand"), sites=(0, 1), range_weight=weight)
    built = SimpleNamespace(
        layout=SimpleNamespace(range_sites=(0, 1, 2), range_loss="cauchy"),
        terms=SimpleNamespace(range_source=np.full((T, K), 2), range_receiver=receiver),
        weights=SimpleNamespace(range_scale=3.0),
    )
    force = np.random.default_rng(6).normal(0.1, 0.3, (T, 2, 3))
    known = np.ones((T, 2)) / 0.2**2
    known[:, 1] = 0.0
    changed = {"force_information": known, "rate_information": 0 * known,
               "orientation_information": 0 * known, "range_information": info}  # fmt: skip
    residuals = {"accelerometer": -force, "range": -residual}
    table = residual_statistics(residuals, changed, built, data, BODY)
    assert set(table) == {"accelerometer/pelvis", "range/belly-pelvis", "range/belly-hand"}
    row = table["accelerometer/pelvis"]
    assert row["bias_units"] == pytest.approx(np.linalg.norm(force[:, 0].mean(0)))
    assert row["rms_units"] == pytest.approx(np.sqrt((force[:, 0] ** 2).mean()))
    assert row["rms"] == pytest.approx(row["rms_units"] / 0.2)
    used = (receiver == 1) & (info > 0)
    row = table["range/belly-hand"]
    for key, value in expected(residual[used], info[used] ** -0.5).items():
        assert row[key] == pytest.approx(value), key
    assert row["heard"] == ((receiver == 1) & (weight > 0)).sum() and row["count"] == used.sum()
    # Cauchy: half of the weight is lost beyond the scale.
    assert row["lowered"] == pytest.approx((residual[used] ** 2 * info[used] > 9).mean())

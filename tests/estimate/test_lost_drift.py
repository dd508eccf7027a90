"""Constants keep their deviations where rounding loses the drift of a free root."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest
from joint_samples import sample

import mocap_jax as mj
from mocap_jax import linalg
from mocap_jax.errors import SolveError
from mocap_jax.estimate.sequence import lost_drift
from mocap_jax.estimate.sequence.problem import SequenceProblem
from mocap_jax.least_squares import SolverOptions
from mocap_jax.solution import Status

# The package has a function of the module's name.
refine = sys.modules[linalg.shifted_factor.__module__]

OPTIONS = mj.OptimiseOptions(
    kinds="AG", root="free", initial="ekf", solver=SolverOptions(max_iterations=6),
    noise=mj.NoiseOptions(adapt=False), constants=mj.ConstantsOptions(adapt=False),
)  # fmt: skip


@pytest.fixture(scope="module")
def recording() -> mj.Recording:
    """Two segments in motion for long enough that J'J is singular in rounding: 4000 frames."""
    return sample("ball", seed=1, seconds=40.0).recording


def test_a_drift_lost_in_rounding_does_not_take_the_constants_with_it(recording) -> None:
    solution = mj.optimise(recording, options=OPTIONS)
    assert solution.status is Status.UNDETERMINED and solution.covariance is None
    assert any("singular at frame" in text for text in solution.remarks)
    assert any("too small by up to a tenth" in text for text in solution.remarks)
    assert solution.calibration_std.keys() == solution.calibration.keys()
    for name, deviation in solution.calibration_std.items():
        prior = solution.calibration_prior_std[name]
        assert np.isfinite(deviation).all() and (deviation > 0).all(), name
        assert (deviation < 1.001 * prior).all(), name
    assert solution.calibration_std["gyroscope_bias/thigh"].max() < 0.005 < 0.01


def test_with_the_largest_shift_their_deviations_are_nearly_those_of_the_plain_factor(
    recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = mj.cut(recording, 0.0, 10.0)
    plain = mj.optimise(part, options=OPTIONS)
    assert plain.status is Status.CONVERGED

    def broken(*_: object) -> None:
        raise SolveError("the normal equations are singular at frame 999 of 1000")

    factor, shifts = refine.factor, []

    def only_the_last(*arguments: Any, damping: float, **more: Any) -> linalg.ArrowFactor:
        shifts.append(damping)
        if len(shifts) % (lost_drift._ATTEMPTS + 1):
            raise SolveError("the normal equations are singular at frame 999 of 1000")
        return factor(*arguments, damping=damping, **more)

    monkeypatch.setattr(SequenceProblem, "factorised", broken)
    monkeypatch.setattr(refine, "factor", only_the_last)
    rounded = mj.optimise(part, options=OPTIONS)
    assert rounded.status is Status.UNDETERMINED and shifts[-1] == max(shifts) > 0
    for name, deviation in plain.calibration_std.items():
        np.testing.assert_allclose(rounded.calibration_std[name], deviation, rtol=0.01)

"""What solutions state of constants where model errors repeat with the motion."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import record

import mocap_jax as mj
from mocap_jax.solution import Solution

FRAMES, RATE_HZ, SIGMA = 420, 140.0, 0.05
FEW = 16.0


@pytest.fixture(scope="module")
def solutions() -> list[Solution]:
    """The same recording, whose readings count as many, or as a 16th of them."""
    recording = record(seconds=FRAMES / RATE_HZ)
    initial = mj.ekf(recording)
    return [
        mj.optimise(
            recording,
            initial=initial,
            options=mj.OptimiseOptions(
                constants=mj.ConstantsOptions(mounting_sigma=SIGMA, adapt=False),
                noise=mj.NoiseOptions(independent_samples=samples, adapt=False),
            ),
        )
        for samples in (1e9, FRAMES / FEW)
    ]


def of_mountings(values: dict[str, np.ndarray]) -> np.ndarray:
    return np.concatenate([np.ravel(v) for k, v in values.items() if k.startswith("mounting_rot")])


def test_priors_are_stated_as_declared(solutions: list[Solution]) -> None:
    for solution in solutions:
        stated = of_mountings(solution.calibration_prior_std)
        np.testing.assert_allclose(stated, SIGMA, rtol=1e-12)


def test_fewer_independent_readings_leave_constants_less_certain(solutions: list[Solution]) -> None:
    many, few = (of_mountings(s.calibration_std) for s in solutions)
    assert (few <= SIGMA * (1 + 1e-9)).all()
    # What the data determine varies by up to the root of 16 more; what the prior does, as before.
    told = many < 0.3 * SIGMA
    assert told.any()
    assert (few[told] > 2 * many[told]).all()
    assert (few[told] < 1.1 * np.sqrt(FEW) * many[told]).all()
    assert (few > 0.98 * many).all()


def test_poses_bear_the_uncertainty_of_constants(solutions: list[Solution]) -> None:
    many, few = (np.diagonal(np.asarray(s.covariance), axis1=1, axis2=2) for s in solutions)
    joints = slice(6, None)
    assert (few[:, joints].mean(0) > many[:, joints].mean(0)).all()

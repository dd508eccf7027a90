"""The true body: what is scaled with a segment."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.motion import human, segment_lengths
from mocap_jax.simulation import PROFILES, default_suit, mount
from mocap_jax.simulation.true_body import true_body


def test_lengths_and_inertia_of_the_human_scale_with_its_segments() -> None:
    body = human()
    suit = default_suit(body)
    nominal = mount(body, suit)
    true, parameters = true_body(nominal, suit, PROFILES["field"], seed=1)
    scale = {name: float(parameters[f"segment_scale/{name}"]) for name in segment_lengths(body)}
    assert max(abs(s - 1) for s in scale.values()) > 0.005
    expected = {name: scale[name] * length for name, length in segment_lengths(nominal).items()}
    assert segment_lengths(true) == pytest.approx(expected, rel=1e-9)
    before, after = nominal.mujoco_model(), true.mujoco_model()
    factors = np.array([scale[before.body(i).name] for i in range(1, before.nbody)])
    np.testing.assert_allclose(after.body_mass, before.body_mass)
    np.testing.assert_allclose(
        after.body_inertia[1:], factors[:, None] ** 2 * before.body_inertia[1:], rtol=1e-9
    )

"""The true body: what is scaled with a segment."""

from __future__ import annotations

import zlib
from collections.abc import Mapping

import numpy as np
import pytest

from mocap_jax.motion import Motion, human, segment_lengths, segment_tip, together
from mocap_jax.simulation import PROFILES, Suit, default_suit, mount
from mocap_jax.simulation.true_body import true_body
from mocap_jax.trajectory import Trajectory

SEGMENT_LENGTH = zlib.crc32(b"segment_length")


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


def scales(parameters: Mapping[str, np.ndarray], owner: str = "") -> dict[str, float]:
    start = f"segment_scale/{owner}"
    return {k.removeprefix(start): float(v) for k, v in parameters.items() if k.startswith(start)}


def test_both_sides_of_everybody_are_of_one_length() -> None:
    body = human()
    still = Motion("still", body, Trajectory(np.arange(2) / 60, np.tile(body.qpos0, (2, 1))))
    pair = together({"a": still, "b": still}).body
    true, parameters = true_body(pair, Suit(()), PROFILES["field"], seed=1)
    _, alone = true_body(body, Suit(()), PROFILES["field"], seed=1)
    a, b = scales(parameters, "a/"), scales(parameters, "b/")
    assert a.keys() == b.keys() == scales(alone).keys()
    for one in (a, b):
        for name in one:
            other = name.replace("Left", "Right")
            assert one[name] == one[other], name
    assert a == scales(alone)  # the first one draws what somebody alone does
    assert a["LeftUpperLeg"] != b["LeftUpperLeg"]
    for person, scale in (("a", a), ("b", b)):
        for name in ("Head", "LeftToe"):
            before, after = (
                segment_tip(x.mujoco_model(), f"{person}/{name}") for x in (pair, true)
            )
            assert before is not None and after is not None
            np.testing.assert_array_equal(before, segment_tip(body.mujoco_model(), name))
            np.testing.assert_allclose(after, scale[name] * before, rtol=1e-9)


def test_somebody_alone_draws_the_lengths_of_old() -> None:
    """Recordings of one seed stay the same from version to version."""
    _, parameters = true_body(human(), Suit(()), PROFILES["field"], seed=1)
    found = scales(parameters)
    draws, expected = np.random.default_rng([1, SEGMENT_LENGTH]), {}
    for name in found:
        sideless = name.removeprefix("Left").removeprefix("Right")
        if sideless not in expected:
            drawn = float(np.clip(draws.standard_normal(), -2.5, 2.5))
            expected[sideless] = 1.0 + PROFILES["field"].segment_length * drawn
        assert found[name] == expected[sideless]

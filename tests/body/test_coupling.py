"""Coordinates that follow others: kept in the text, followed exactly."""

from __future__ import annotations

from xml.etree import ElementTree

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.body import Coupling, coupled_joints, couplings, follow, load_body
from mocap_jax.body.coupling import coupling_elements
from mocap_jax.body.piecewise import Piecewise, pieced, straight

XML = """<mujoco><worldbody><body name="a"><joint name="lead" axis="0 0 1"/>
<geom size="0.1"/><body name="b"><joint name="first" axis="1 0 0"/><joint name="second"
axis="0 1 0"/><geom size="0.1"/></body></body></worldbody>{custom}</mujoco>"""
CUBIC = pieced(
    np.array([0.0, 0.5, 1.5]), np.array([[0.0, 1.0, 0.0, -0.5], [0.4375, 0.625, -0.75, 0.2]])
)


def coupled_body():
    chain = (Coupling("first", "lead", CUBIC), Coupling("second", "first", straight(0.1, -2.0)))
    custom = ElementTree.Element("custom")
    for coupling in chain:
        custom.extend(coupling_elements(coupling))
    return load_body(XML.format(custom=ElementTree.tostring(custom, encoding="unicode"))), chain


def test_the_text_keeps_them():
    body, chain = coupled_body()
    assert couplings(body) == chain
    assert coupled_joints(body) == {"first", "second"}
    assert couplings(load_body(XML.format(custom=""))) == ()


@pytest.mark.parametrize("lead", [-0.7, 0.2, 0.5, 1.2, 2.0])
def test_followers_follow(lead: float):
    body, _ = coupled_body()
    q = np.asarray(follow(body, jnp.array([lead, 9.0, 9.0])))
    first = float(CUBIC(np.asarray(lead)))
    np.testing.assert_allclose(q, [lead, first, 0.1 - 2 * first], atol=1e-14)
    slope = np.asarray(jax.jacfwd(lambda x: follow(body, x))(q))[:, 0]
    step = 1e-6
    numeric = [np.asarray(follow(body, q + np.array([s, 0, 0]))) for s in (step, -step)]
    np.testing.assert_allclose(slope, (numeric[0] - numeric[1]) / (2 * step), atol=1e-6)


def test_pieces_are_straight_beyond_their_ends():
    outside = CUBIC(np.array([-2.0, -1.0, 0.0]))
    assert np.diff(outside, 2) == pytest.approx(0.0)
    assert Piecewise((), (1.0,), ((2.0, 3.0, 0.0),)).line == (-1.0, 3.0)
    assert CUBIC.line is None

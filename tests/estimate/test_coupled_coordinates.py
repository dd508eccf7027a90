"""The whole-sequence solve holds coordinates that follow others to their functions."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from mocap_jax.body import Coupling, load_body
from mocap_jax.body.coupling import coupling_elements
from mocap_jax.body.piecewise import straight
from mocap_jax.errors import InputError
from mocap_jax.estimate.sequence.coupled import coupled_coordinates
from mocap_jax.estimate.sequence.user_residuals import COUPLINGS, UserResidual, check_names

XML = """<mujoco><worldbody><body name="a"><joint name="lead" axis="0 0 1"/><joint name="own"
axis="1 0 0"/><geom size="0.1"/></body></worldbody>{custom}</mujoco>"""


def test_the_residual_is_the_distance_from_the_function():
    custom = ElementTree.Element("custom")
    custom.extend(coupling_elements(Coupling("own", "lead", straight(0.1, -2.0))))
    body = load_body(XML.format(custom=ElementTree.tostring(custom, encoding="unicode")))
    (residual,), (data,) = coupled_coordinates(body, 5)
    assert residual.name == COUPLINGS
    assert data["root_information"].shape == (5,)
    row = {"root_information": data["root_information"][2]}
    value = residual.function(body, np.array([[0.3, 0.2]]), row)
    assert np.asarray(value) == pytest.approx([(0.2 - (0.1 - 0.6)) / 1e-3])
    # Equal problems share a program.
    assert residual == coupled_coordinates(body, 5)[0][0]
    assert hash(residual) == hash(coupled_coordinates(body, 5)[0][0])


def test_bodies_without_followers_have_none():
    assert coupled_coordinates(load_body(XML.format(custom="")), 5) == ((), ())


def test_the_name_is_taken():
    with pytest.raises(InputError, match="the name is taken"):
        check_names((UserResidual(COUPLINGS, lambda body, q, data: q),))

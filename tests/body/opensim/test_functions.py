"""Functions of OpenSim models, against their definitions."""

from __future__ import annotations

from xml.etree import ElementTree

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from naive import spline_value, value_of

from mocap_jax.body.opensim.functions import function_of
from mocap_jax.errors import InputError

KINDS = {
    "Constant": "<Constant><value>0.7</value></Constant>",
    "line": "<LinearFunction><coefficients>-2 0.3</coefficients></LinearFunction>",
    "polynomial": "<PolynomialFunction><coefficients>1 -2 0.5 3</coefficients>"
    "</PolynomialFunction>",
    "polyline": "<PiecewiseLinearFunction><x>-1 0 2</x><y>1 0 3</y></PiecewiseLinearFunction>",
    "multiplied": "<MultiplierFunction><LinearFunction><coefficients>2 1</coefficients>"
    "</LinearFunction><scale>-0.5</scale></MultiplierFunction>",
}


def made(text: str):
    holder = ElementTree.fromstring(f"<coupled>{text}</coupled>")
    return holder[0], function_of(holder, "test")


@pytest.mark.parametrize("kind", KINDS)
def test_values(kind: str):
    element, function = made(KINDS[kind])
    for x in (-2.0, -0.4, 0.0, 1.1, 5.0):
        assert float(function(np.asarray(x))) == pytest.approx(value_of(element, x), abs=1e-12)
        assert float(function.at(jnp.asarray(x))) == pytest.approx(value_of(element, x), abs=1e-12)


@pytest.mark.parametrize("count", [3, 4, 5, 9])
def test_simm_spline_satisfies_its_conditions(count: int):
    generator = np.random.default_rng(count)
    x, y = np.sort(generator.uniform(0, 2, count)), generator.normal(size=count)
    text = " ".join(map(str, x)), " ".join(map(str, y))
    _, spline = made(f"<SimmSpline><x>{text[0]}</x><y>{text[1]}</y></SimmSpline>")
    at = np.linspace(x[0] - 0.5, x[-1] + 0.5, 41)
    expected = [spline_value(x, y, float(a)) for a in at]
    np.testing.assert_allclose(spline(at), expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(spline(x), y, atol=1e-12)


def test_two_points_make_a_line():
    _, spline = made("<SimmSpline><x>1 3</x><y>2 -2</y></SimmSpline>")
    assert spline.line == pytest.approx((4.0, -2.0))


def test_derivative_is_continuous_and_right():
    _, spline = made("<SimmSpline><x>0 1 2 3</x><y>0 1 0 2</y></SimmSpline>")
    for x in (-0.5, 0.4, 1.0, 2.9, 3.5):
        slope = float(jax.grad(spline.at)(x))
        numeric = (spline(np.asarray(x + 1e-6)) - spline(np.asarray(x - 1e-6))) / 2e-6
        assert slope == pytest.approx(float(numeric), abs=1e-5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<GCVSpline name='function'></GCVSpline>", "function GCVSpline is not supported; valid:"),
        ("<SimmSpline><x>0 1 1</x><y>0 1 2</y></SimmSpline>", "x must increase"),
        ("<SimmSpline><x>0 1 2</x><y>0 1</y></SimmSpline>", "3 x and 2 y"),
        ("<LinearFunction><coefficients>1</coefficients></LinearFunction>", "2 numbers, not 1"),
        ("<Constant><value>nan</value></Constant>", "finite numbers"),
        ("<Constant><value>one</value></Constant>", "could not convert"),
    ],
)
def test_wrong_functions(text: str, message: str):
    with pytest.raises(InputError, match=message):
        made(text)

"""Functions of one coordinate in OpenSim models."""

from __future__ import annotations

from collections.abc import Callable
from xml.etree.ElementTree import Element

import numpy as np
from scipy.interpolate import PPoly, make_interp_spline

from mocap_jax.body.opensim.elements import numbers_of
from mocap_jax.body.piecewise import Piecewise, pieced, straight
from mocap_jax.errors import InputError


def function_of(element: Element, where: str) -> Piecewise:
    """Function that an element states, in either layout of the format.

    Args:
        element: holds the function itself (`<function><LinearFunction>` of the old layout, or the
            function as a child of the element).
        where: what it belongs to, for messages.

    Raises:
        InputError: the kind of function is not represented, or its numbers are wrong.
    """
    holder = element.find("function")
    children = list(element if holder is None else holder)
    found = [e for e in children if e.tag in _KINDS]
    if len(found) != 1:
        unknown = [
            e.tag for e in children if holder is not None or e.get("name") == "function"
        ] or ["none"]
        raise InputError(
            f"{where}: function {', '.join(unknown)} is not supported; valid: {', '.join(_KINDS)}"
        )
    try:
        return _KINDS[found[0].tag](found[0], where)
    except (ValueError, IndexError) as error:
        raise InputError(f"{where}: {found[0].tag}: {error}") from error


def _constant(element: Element, where: str) -> Piecewise:
    return straight(float(numbers_of(element, "value", where, 1)[0]))


def _line(element: Element, where: str) -> Piecewise:
    slope, constant = numbers_of(element, "coefficients", where, 2)
    return straight(float(constant), float(slope))


def _polynomial(element: Element, where: str) -> Piecewise:
    """The file has the highest power first."""
    coefficients = numbers_of(element, "coefficients", where)[::-1]
    return Piecewise((), (0.0,), (tuple(float(c) for c in coefficients),))


def _multiplied(element: Element, where: str) -> Piecewise:
    return function_of(element, where).scaled(float(numbers_of(element, "scale", where, 1)[0]))


def _points(element: Element, where: str) -> tuple[np.ndarray, np.ndarray]:
    x, y = (numbers_of(element, tag, where) for tag in ("x", "y"))
    if len(x) != len(y) or len(x) < 2:
        raise InputError(f"{where}: {element.tag} has {len(x)} x and {len(y)} y (two or more)")
    if not (np.diff(x) > 0).all():
        raise InputError(f"{where}: {element.tag}: x must increase")
    return x, y


def _polyline(element: Element, where: str) -> Piecewise:
    x, y = _points(element, where)
    return pieced(x, np.stack([y[:-1], np.diff(y) / np.diff(x)], axis=1))


def _simm_spline(element: Element, where: str) -> Piecewise:
    """Interpolating cubic spline with the end conditions of Forsythe, Malcolm and Moler (1977).

    Its third derivative at either end is that of the cubic through the four nearest points, zero
    where there are only three; beyond the ends it goes on straight.
    """
    x, y = _points(element, where)
    if len(x) == 2:
        return straight(float(y[0] - x[0] * (y[1] - y[0]) / (x[1] - x[0])),
                        float((y[1] - y[0]) / (x[1] - x[0])))  # fmt: skip
    ends = [_third_derivative(x[s], y[s]) if len(x) > 3 else 0.0
            for s in (slice(4), slice(-4, None))]  # fmt: skip
    spline = make_interp_spline(x, y, k=3, bc_type=([(3, ends[0])], [(3, ends[1])]))
    # Of a B-spline's pieces those of the repeated end knots are empty.
    cubic = PPoly.from_spline(spline)
    kept = np.diff(cubic.x) > 0
    return pieced(x, cubic.c[::-1, kept].T)


def _third_derivative(x: np.ndarray, y: np.ndarray) -> float:
    """Of the cubic through four points."""
    apart = x[:, None] - x + np.eye(4)
    return float(6.0 * (y / apart.prod(axis=1)).sum())


_KINDS: dict[str, Callable[[Element, str], Piecewise]] = {
    "Constant": _constant,
    "LinearFunction": _line,
    "PolynomialFunction": _polynomial,
    "SimmSpline": _simm_spline,
    "NaturalCubicSpline": _simm_spline,
    "natCubicSpline": _simm_spline,
    "PiecewiseLinearFunction": _polyline,
    "MultiplierFunction": _multiplied,
}

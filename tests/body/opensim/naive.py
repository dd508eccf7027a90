"""OpenSim's forward kinematics as a plain loop over the document, for the layout of OpenSim 4."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

KINDS = {
    "WeldJoint": ("", ""), "PinJoint": ("z", ""), "SliderJoint": ("", "x"),
    "UniversalJoint": ("xy", ""), "GimbalJoint": ("xyz", ""), "BallJoint": ("xyz", ""),
    "PlanarJoint": ("z", "xy"), "FreeJoint": ("xyz", "xyz"),
}  # fmt: skip


def naive_frames(text: str, values: dict[str, float]) -> dict[str, np.ndarray]:
    """4x4 frames of all bodies in the ground (Y up); coordinates not given have their defaults."""
    model = ElementTree.fromstring(text).find("Model")
    q = {c.get("name"): float(c.findtext("default_value")) for c in model.iter("Coordinate")}
    q |= values
    for coupler in model.iter("CoordinateCouplerConstraint"):
        leader = coupler.findtext("independent_coordinate_names").strip()
        function = coupler.find("coupled_coordinates_function")[0]
        q[coupler.findtext("dependent_coordinate_name").strip()] = value_of(function, q[leader])
    world = {"ground": np.eye(4)}
    joints = list(model.find("JointSet/objects"))
    while joints:
        joint = joints.pop(0)
        (parent, P), (child, C) = (_frame(joint, s) for s in ("parent", "child"))
        if parent not in world:
            joints.append(joint)
            continue
        world[child] = world[parent] @ P @ _motion(joint, q) @ np.linalg.inv(C)
    return world


def _frame(joint, side: str) -> tuple[str, np.ndarray]:
    name = joint.findtext(f"socket_{side}_frame").strip()
    element = next(f for f in joint.iter("PhysicalOffsetFrame") if f.get("name") == name)
    T = np.eye(4)
    x, y, z = (float(v) for v in element.findtext("orientation").split())
    T[:3, :3] = turn([1, 0, 0], x) @ turn([0, 1, 0], y) @ turn([0, 0, 1], z)
    T[:3, 3] = [float(v) for v in element.findtext("translation").split()]
    return element.findtext("socket_parent").strip().split("/")[-1], T


def turn(axis, angle: float) -> np.ndarray:
    axis = np.asarray(axis, float)
    return Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle).as_matrix()


def _motion(joint, q: dict[str, float]) -> np.ndarray:
    T, names = np.eye(4), [c.get("name") for c in joint.iter("Coordinate")]
    if joint.tag in KINDS:
        turns, shifts = KINDS[joint.tag]
        for letter, name in zip(turns, names, strict=False):
            T[:3, :3] = T[:3, :3] @ turn(np.eye(3)["xyz".index(letter)], q[name])
        for letter, name in zip(shifts, names[len(turns) :], strict=True):
            T["xyz".index(letter), 3] += q[name]
        return T
    for element in joint.find("SpatialTransform"):
        axis = np.array([float(v) for v in element.findtext("axis").split()])
        name = (element.findtext("coordinates") or "").strip()
        function = next(e for e in element if e.tag not in ("coordinates", "axis"))
        amount = value_of(function, q[name] if name else 0.0)
        if element.get("name").startswith("rotation"):
            T[:3, :3] = T[:3, :3] @ turn(axis, amount)
        else:
            T[:3, 3] += axis / np.linalg.norm(axis) * amount
    return T


def value_of(function, x: float) -> float:
    numbers = lambda tag: np.array([float(v) for v in function.findtext(tag).split()])  # noqa: E731
    if function.tag == "Constant":
        return numbers("value")[0]
    if function.tag in ("LinearFunction", "PolynomialFunction"):
        return float(np.polyval(numbers("coefficients"), x))
    if function.tag == "MultiplierFunction":
        return numbers("scale")[0] * value_of(function[0], x)
    if function.tag == "PiecewiseLinearFunction":
        X, Y = numbers("x"), numbers("y")
        i = int(np.clip(np.searchsorted(X, x) - 1, 0, len(X) - 2))
        return Y[i] + (x - X[i]) * (Y[i + 1] - Y[i]) / (X[i + 1] - X[i])
    assert function.tag == "SimmSpline"
    return spline_value(numbers("x"), numbers("y"), x)


def spline_value(X: np.ndarray, Y: np.ndarray, x: float) -> float:
    """From the conditions themselves: all coefficients of all pieces by one dense system."""
    n = len(X) - 1
    rows, right = [], []

    def row(piece: int, at: float, order: int) -> np.ndarray:
        out, d = np.zeros(4 * n), at - X[piece]
        for k in range(order, 4):
            factor = np.prod([k - j for j in range(order)]) if order else 1.0
            out[4 * piece + k] = factor * d ** (k - order)
        return out

    for i in range(n):
        rows += [row(i, X[i], 0), row(i, X[i + 1], 0)]
        right += [Y[i], Y[i + 1]]
    for i in range(1, n):
        rows += [row(i - 1, X[i], k) - row(i, X[i], k) for k in (1, 2)]
        right += [0.0, 0.0]
    for piece, part in ((0, slice(4)), (n - 1, slice(-4, None))):
        cubic = np.linalg.solve(np.vander(X[part] - X[part][0]), Y[part])[0] if n > 2 else 0.0
        rows.append(row(piece, X[piece], 3))
        right.append(6.0 * cubic)
    c = np.linalg.solve(np.array(rows), np.array(right))
    inside = float(np.clip(x, X[0], X[-1]))
    i = int(np.clip(np.searchsorted(X, inside) - 1, 0, n - 1))
    return float(row(i, inside, 0) @ c + (x - inside) * (row(i, inside, 1) @ c))

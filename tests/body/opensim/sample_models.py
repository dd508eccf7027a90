"""An OpenSim model that uses every kind of joint and function, in both layouts of the format."""

from __future__ import annotations

LINE = "<LinearFunction{n}><coefficients>{a} {b}</coefficients></LinearFunction>"
CONSTANT = "<Constant{n}><value>{a}</value></Constant>"
SPLINE = "<SimmSpline{n}><x>0 0.4 0.9 1.3 2</x><y>0 0.05 0.02 0.11 0.3</y></SimmSpline>"
ROLL = "<SimmSpline{n}><x>0 0.7 1.4 2</x><y>0 0.004 0.005 0.001</y></SimmSpline>"
POLYNOMIAL = (
    "<PolynomialFunction{n}><coefficients>0.004 -0.01 0.005</coefficients></PolynomialFunction>"
)
POLYLINE = "<PiecewiseLinearFunction{n}><x>-1 0 2</x><y>0.1 0 -0.3</y></PiecewiseLinearFunction>"

# name, parent, kind, coordinates (name, default, low, high, clamped, locked), parent frame
# (translation, orientation), child frame, axes (coordinates, axis, function) of a CustomJoint
JOINTS = [
    ("root", "ground", "FreeJoint",
     [(f"root_{k}", d, -2, 2, False, False) for k, d in
      (("rx", 0.1), ("ry", -0.2), ("rz", 0.05), ("tx", 0.3), ("ty", 0.9), ("tz", -0.1))],
     ("0.1 0 0.2", "0.3 0.1 -0.2"), ("0.01 0.02 0", "0 0.2 0"), None),
    ("pin", "root", "PinJoint", [("pin_angle", 0.3, -1, 1.5, True, False)],
     ("0.1 -0.2 0.05", "0.2 -0.4 1.1"), ("0.03 0.01 -0.02", "-0.3 0.5 0.2"), None),
    ("universal", "pin", "UniversalJoint",
     [("u_one", 0.1, -1, 1, True, False), ("u_two", -0.2, -1, 1, False, False)],
     ("0 -0.3 0", "0 0.3 0"), ("0 0.05 0", "0.1 0 0.4"), None),
    ("ball", "root", "BallJoint", [(f"ball_{k}", 0.1, -1, 1, False, False) for k in "xyz"],
     ("-0.1 0.2 0", "0 0 0.3"), ("0.02 0 0", "0.2 0 0"), None),
    ("weld", "ball", "WeldJoint", [], ("0 0.1 0", "0.1 0.2 0.3"), ("0.02 0 0", "0 0 0"), None),
    ("slider", "weld", "SliderJoint", [("slide", 0.05, -0.3, 0.3, True, False)],
     ("0 0.1 0", "0.1 0.2 0.3"), ("0.02 0 0.1", "0 0.6 0"), None),
    ("planar", "weld", "PlanarJoint",
     [("plane_turn", 0.2, -1, 1, True, False), ("plane_x", 0.1, -1, 1, False, False),
      ("plane_y", 0.0, -1, 1, False, False)],
     ("0.1 0.1 0", "0 0.2 0"), ("0 0.01 0", "0.3 0 0"), None),
    ("gimbal", "root", "GimbalJoint",
     [("g_x", 0.1, -1, 1, True, False), ("g_y", 0.4, -1, 1, True, True),
      ("g_z", -0.1, -1, 1, True, False)],
     ("0 0.2 0.1", "0 0 0"), ("0 0.02 0", "0 0.1 0"), None),
    ("knee", "universal", "CustomJoint", [("bend", 0.2, 0, 2, True, False)],
     ("0.01 -0.4 0", "0.2 0.1 0"), ("-0.01 0.02 0", "0.2 0.1 0.05"),
     [("", "1 0 0", CONSTANT.format(a=0.15, n="{n}")),
      ("bend", "0 0 2", LINE.format(a=-1, b=0.1, n="{n}")),
      ("bend", "0 1 0.2", SPLINE), ("bend", "1 0 0", ROLL), ("bend", "0 1 0", POLYNOMIAL),
      ("", "0 0 1", CONSTANT.format(a=0.01, n="{n}"))]),
    ("toe", "knee", "CustomJoint", [("toe_angle", 0.0, -1, 1, True, False)],
     ("0 -0.3 0", "0 0 0"), ("0 0.03 0", "0 0 0"),
     [("toe_angle", "0 0 1", LINE.format(a=1, b=0, n="{n}")),
      ("toe_angle", "1 0 0",
       "<MultiplierFunction{n}>{w}" + POLYLINE + "{e}<scale>0.5</scale></MultiplierFunction>"),
      ("", "0 1 0", CONSTANT.format(a=0, n="{n}")), ("", "1 0 0", CONSTANT.format(a=0.02, n="{n}")),
      ("", "0 1 0", CONSTANT.format(a=0, n="{n}")), ("", "0 0 1", CONSTANT.format(a=0, n="{n}"))]),
    ("copy", "root", "PinJoint", [("copy_angle", 0.0, -1, 1, False, False)],
     ("0 0 0.3", "0 0 0"), ("0 0 0.02", "0 0 0"), None),
    ("cap", "universal", "CustomJoint", [("cap_beta", 0.0, -99, 99, False, False)],
     ("0.05 -0.4 0", "0 0 0"), ("0 0 0", "0 0 0"),
     [("cap_beta", "0 0 1", SPLINE)] + [("", a, CONSTANT.format(a=0, n="{n}"))
      for a in ("0 1 0", "1 0 0", "1 0 0", "0 1 0", "0 0 1")]),
]  # fmt: skip
COUPLERS = [
    ("copy_angle", "pin_angle", LINE.format(a=0.5, b=0.1, n="")),
    ("cap_beta", "bend", LINE.format(a=1, b=0, n="")),
]


def sample_model(version: int = 40000) -> str:
    """The document, in the layout of OpenSim 4 or (30000) of OpenSim 3."""
    old = version < 40000
    bodies, joints = "", ""
    for number, (name, *_) in enumerate(JOINTS):
        joint = _joint(JOINTS[number], old)
        inertia = "0.02 0.03 0.02 0.001 0 0.002"
        if old:
            tags = zip(("xx", "yy", "zz", "xy", "xz", "yz"), inertia.split(), strict=True)
            inertia = "".join(f"<inertia_{t}>{v}</inertia_{t}>" for t, v in tags)
            joint = f"<Joint>{joint}</Joint>"
        else:
            inertia, joint, joints = f"<inertia>{inertia}</inertia>", "", joints + joint
        bodies += (
            f'<Body name="{name}"><mass>{number + 1}</mass><mass_center>0 -0.1 0.01</mass_center>'
            f"{inertia}{joint}</Body>"
        )
    if old:
        bodies = f'<Body name="ground"><mass>0</mass><Joint /></Body>{bodies}'
    couplers = "".join(
        f'<CoordinateCouplerConstraint name="c{i}"><coupled_coordinates_function>{f}'
        f"</coupled_coordinates_function><independent_coordinate_names>{leader}"
        f"</independent_coordinate_names><dependent_coordinate_name>{own}"
        "</dependent_coordinate_name></CoordinateCouplerConstraint>"
        for i, (own, leader, f) in enumerate(COUPLERS)
    )
    return (
        f'<OpenSimDocument Version="{version}"><Model name="sample"><gravity>0 -9.8 0</gravity>'
        f"<BodySet><objects>{bodies}</objects></BodySet>"
        + (f"<JointSet><objects>{joints}</objects></JointSet>" if joints else "")
        + f"<ConstraintSet><objects>{couplers}</objects></ConstraintSet></Model></OpenSimDocument>"
    )


def _joint(entry: tuple, old: bool) -> str:
    name, parent, kind, coordinates, on_parent, on_child, axes = entry
    inner = "".join(
        f'<Coordinate name="{c}"><default_value>{d}</default_value><range>{low} {high}</range>'
        f"<clamped>{str(clamped).lower()}</clamped><locked>{str(locked).lower()}</locked>"
        "</Coordinate>"
        for c, d, low, high, clamped, locked in coordinates
    )
    transform = _transform(axes, old) if axes else ""
    if old:
        return (
            f'<{kind} name="{name}"><parent_body>{parent}</parent_body>'
            f"<location_in_parent>{on_parent[0]}</location_in_parent>"
            f"<orientation_in_parent>{on_parent[1]}</orientation_in_parent>"
            f"<location>{on_child[0]}</location><orientation>{on_child[1]}</orientation>"
            f"<CoordinateSet><objects>{inner}</objects></CoordinateSet>{transform}</{kind}>"
        )
    frames = "".join(
        f'<PhysicalOffsetFrame name="{body}_offset{side}"><socket_parent>{path}</socket_parent>'
        f"<translation>{at[0]}</translation><orientation>{at[1]}</orientation></PhysicalOffsetFrame>"
        for side, body, path, at in (
            (1, parent, "/ground" if parent == "ground" else f"/bodyset/{parent}", on_parent),
            (2, name, f"/bodyset/{name}", on_child),
        )
    )
    return (
        f'<{kind} name="{name}"><socket_parent_frame>{parent}_offset1</socket_parent_frame>'
        f"<socket_child_frame>{name}_offset2</socket_child_frame><coordinates>{inner}</coordinates>"
        f"<frames>{frames}</frames>{transform}</{kind}>"
    )


def _transform(axes: list, old: bool) -> str:
    names = [f"{k}{i}" for k in ("rotation", "translation") for i in (1, 2, 3)]
    out = ""
    for label, (coordinate, axis, function) in zip(names, axes, strict=True):
        tag = {"n": "" if old else ' name="function"', "w": "<function>" if old else "",
               "e": "</function>" if old else ""}  # fmt: skip
        stated = function.format(**tag)
        stated = f"<function>{stated}</function>" if old else stated
        out += (
            f'<TransformAxis name="{label}"><coordinates>{coordinate}</coordinates>'
            f"<axis>{axis}</axis>{stated}</TransformAxis>"
        )
    return f"<SpatialTransform>{out}</SpatialTransform>"

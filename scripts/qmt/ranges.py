"""Published ranges of joint motion, as the joint angles that our reports name.

Limbs, neck and trunk as a whole: the larger of the American Academy of Orthopaedic Surgeons' normal
range (1965, Joint motion: method of measuring and recording) and the mean of Boone and Azen 1979 (J
Bone Joint Surg 61-A:756-759); shoulder girdle: Kapandji, rounded (docs/human.md).
"""

from __future__ import annotations

# Segment and the one that it is measured against -> angle -> lowest, highest [deg].
RANGES: dict[tuple[str, str], dict[str, tuple[float, float]]] = {
    ("T8", "Pelvis"): {
        "flexion": (-30, 80), "lateral_bending": (-35, 35), "axial_rotation": (-45, 45),
    },
    ("Head", "T8"): {
        "flexion": (-45, 45), "lateral_bending": (-45, 45), "axial_rotation": (-60, 60),
    },
}  # fmt: skip
_SIDED: dict[tuple[str, str], dict[str, tuple[float, float]]] = {
    ("Shoulder", "T8"): {"protraction": (-25, 30), "depression": (-40, 10)},
    ("UpperArm", "T8"): {
        "flexion": (-62, 180), "abduction": (-50, 184), "internal_rotation": (-104, 70),
    },
    ("ForeArm", "UpperArm"): {"flexion": (-5, 150), "pronation": (-82, 80)},
    ("Hand", "ForeArm"): {"flexion": (-75, 80), "radial_deviation": (-36, 22)},
    ("UpperLeg", "Pelvis"): {
        "flexion": (-30, 122), "abduction": (-30, 46), "internal_rotation": (-47, 47),
    },
    ("LowerLeg", "UpperLeg"): {"flexion": (-10, 143)},
    ("Foot", "LowerLeg"): {"dorsiflexion": (-56, 30), "eversion": (-37, 21)},
}  # fmt: skip
_MIDDLE = ("Pelvis", "T8")
for side in ("Right", "Left"):
    for (_child, _parent), _angles in _SIDED.items():
        RANGES[side + _child, _parent if _parent in _MIDDLE else side + _parent] = _angles

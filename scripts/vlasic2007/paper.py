"""What the paper prints: Vlasic et al. 2007, Practical Motion Capture in Everyday Surroundings."""

from __future__ import annotations

COMBINATIONS = ("A", "A+D", "D", "G", "G+D", "A+G", "A+G+D")
"""Of accelerometers, gyroscopes and distances, in the order of table 1."""
ODD = ("A", "A+D", "D")
"""Those without gyroscopes, of which section 6 says that they perform poorly."""
ALL = "A+G+D"

JOINTS = {"Neck": "Head", "Right shoulder": "RightUpperArm", "Left hip": "LeftUpperLeg"}
"""The joints of table 1 and our segments, whose rotation relative to the Pelvis is compared. In
the paper all three hang directly under the root, whose pose is given."""

TABLE_1 = {
    "A": ((159.7, 147.7), (168.6, 105.9), (184.0, 146.0)),
    "A+D": ((74.0, 125.4), (178.6, 110.9), (165.5, 144.5)),
    "D": ((120.2, 93.4), (54.7, 37.0), (117.4, 79.2)),
    "G": ((25.9, 15.9), (10.1, 7.0), (8.3, 8.0)),
    "G+D": ((18.4, 7.4), (8.1, 5.8), (9.8, 5.4)),
    "A+G": ((9.5, 3.4), (10.9, 6.4), (5.6, 4.0)),
    "A+G+D": ((5.7, 2.9), (8.0, 5.0), (6.6, 3.8)),
}
"""Mean and standard deviation over 30 s of the angle to Vicon's reconstruction [deg], by joint."""

FRAMES_PER_SECOND = 10.0
"""Processing rate (section 6)."""


def mean_of_joints(combination: str) -> float:
    """Mean of the three joints' mean errors [deg]."""
    return sum(mean for mean, _ in TABLE_1[combination]) / len(JOINTS)

"""`JointFinding`: what the motion of two sensors tells of the joint between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

JointKind = Literal["hinge", "universal", "ball"]
# Sensors that agree on less of the acceleration's variance hardly share a joint.
_DOUBTFUL = 0.8
_WORDS = {
    "hinge": "hinge (one axis)",
    "universal": "universal joint (two axes, one fixed on either side)",
    "ball": "ball joint (three axes)",
}


@dataclass(frozen=True)
class JointFinding:
    """A joint between two sensors; everything stands in the sensors' own frames."""

    sensors: tuple[str, str]
    kind: JointKind
    """As far as the motion shows: a ball joint that turned about one axis only is found a hinge."""
    off_axis: Mapping[str, float]
    """Share of the relative rate (root mean square) off the axis of the best `hinge` and, where it
    is none, off the axes of the best `universal` joint: small where the joint is one."""
    first_arm: Float[np.ndarray, "3"]
    """From the first sensor to the joint's centre [m]; zero along `undetermined` directions."""
    second_arm: Float[np.ndarray, "3"]
    """The same from the second sensor, in its frame."""
    arm_covariance: Float[np.ndarray, "6 6"]
    """Of both arms [m^2]; along undetermined directions the prior's."""
    undetermined: Float[np.ndarray, "k 6"]
    """Unit directions of both arms together that the motion does not tell. Of a hinge, the first is
    the axis in both frames: any point of the axis serves as centre."""
    first_axis: Float[np.ndarray, "3"] | None
    """Axis fixed on the first sensor's side; None of a ball joint. Of a hinge, the axis."""
    second_axis: Float[np.ndarray, "3"] | None
    """Axis fixed on the second sensor's side. Of a hinge, the same axis in this frame: a positive
    angle turns the second sensor about it."""
    axis_std: Float[np.ndarray, "2"] | None
    """Deviation of each axis, across itself [rad]."""
    time: Float[np.ndarray, "t"]
    """Of `relative` [s]."""
    relative: Float[np.ndarray, "t 4"]
    """Orientation of the second sensor in the first's frame (wxyz), window by window."""
    start: Float[np.ndarray, "4"]
    """Orientation of the first sensor at the first of these times (wxyz); its heading is free. The
    joint is taken to go nowhere in the first window."""
    gyroscope_bias: Float[np.ndarray, "2 3"]
    """[rad/s]"""
    clock_offset: float
    """What the second sensor's stamps say less the first's, of the same moment [s]."""
    residual: float
    """What both sensors differ by in the joint, root mean square of a component [m/s^2]."""
    explained: float
    """Share of the variance of specific forces in the joint that both sensors agree on, 0 to 1."""

    @property
    def arm_std(self) -> Float[np.ndarray, "2 3"]:
        """Deviations of both arms' components [m]."""
        return np.sqrt(np.diag(self.arm_covariance)).reshape(2, 3)

    @property
    def sentences(self) -> tuple[str, ...]:
        """All of it in words."""
        first, second = self.sensors
        lines = [f"{first} and {second}: {_WORDS[self.kind]}. {self._evidence()}"]
        for name, arm, std in zip(
            self.sensors, (self.first_arm, self.second_arm), self.arm_std, strict=True
        ):
            lines.append(f"Centre from {name} [cm]: {_numbers(arm)}, deviation {_numbers(std)}.")
        return (*lines, *self._axes(), *self._doubts())

    def __str__(self) -> str:
        return "\n".join(self.sentences)

    def _evidence(self) -> str:
        shares = {k: f"{100 * share:.1f} %" for k, share in self.off_axis.items()}
        text = f"Of the relative rate, {shares['hinge']} is off the best single axis"
        if "universal" in shares:
            text += f" and {shares['universal']} off the best two"
        return text + "."

    def _axes(self) -> list[str]:
        if self.first_axis is None or self.second_axis is None or self.axis_std is None:
            return []
        axes = zip(self.sensors, (self.first_axis, self.second_axis), self.axis_std, strict=True)
        return [
            f"Axis in {name}: {_direction(axis, 3)}, deviation {np.rad2deg(std):.2f} deg."
            for name, axis, std in axes
        ]

    def _doubts(self) -> list[str]:
        """What is not known, and what should not be believed."""
        lines = []
        first, second = self.sensors
        for i, direction in enumerate(self.undetermined):
            one, two = (_direction(d, 2) for d in direction.reshape(2, 3))
            why = "the motion does not tell it"
            if self.kind == "hinge" and i == 0:
                why = "any point of a hinge's axis is a centre"
            lines.append(
                f"Not determined: the centre along {one} in {first} with {two} in {second}; {why}."
            )
        if self.explained < _DOUBTFUL:
            lines.append(
                f"Doubtful: both sensors agree on {100 * self.explained:.0f} % of the acceleration "
                "in the joint only. Are they on neighbouring segments, rigidly mounted?"
            )
        return lines


def _numbers(metres: Float[np.ndarray, "3"]) -> str:
    return ", ".join(f"{100 * x:.2f}" for x in metres)


def _direction(vector: Float[np.ndarray, "3"], digits: int) -> str:
    return "(" + ", ".join(f"{x + 0.0:.{digits}f}" for x in vector) + ")"

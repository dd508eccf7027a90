"""Handwriting as a path on a plane: letters of single strokes, drawn at the speed hands have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

RATE = 120.0
"""Points of a path per second."""
# Distance between neighbouring letters, in heights of a small letter.
_GAP = 0.35
# Hands draw a curve with the speed (radius of curvature)^(1/3) (Lacquaniti, Terzuolo, Viviani 1983,
# Acta Psychologica 54): this many seconds a height, where it bends by one radian a height.
_PACE = 0.35
_LIFT_SECONDS = 0.55
_POINTS = 400


def _arc(centre: tuple[float, float], radii: tuple[float, float], start: float, end: float):
    """Points of an ellipse from one angle to another [deg]."""
    turn = np.radians(np.linspace(start, end, 2 + int(abs(end - start) // 30)))
    return np.array(centre) + np.array(radii) * np.stack([np.cos(turn), np.sin(turn)], axis=1)


_BOWL = ((0.38, 0.5), (0.38, 0.5))
# Strokes of each letter as points on a smooth curve; a small letter is one high.
_LETTERS = {
    "m": [[(0, 1), (0, 0.5), (0, 0.1), (0.03, 0), (0.06, 0.1), (0.08, 0.6), (0.24, 0.97),
           (0.42, 0.85), (0.46, 0.4), (0.46, 0.1), (0.49, 0), (0.52, 0.1), (0.54, 0.6),
           (0.7, 0.97), (0.88, 0.85), (0.92, 0.4), (0.92, 0)]],
    "o": [_arc(*_BOWL, 90, 450)],
    "c": [_arc(*_BOWL, 50, 310)],
    "a": [_arc(*_BOWL, 40, 400), [(0.76, 1), (0.76, 0.5), (0.76, 0)]],
    "p": [[(0, 1), (0, 0.1), (0, -0.8)], _arc((0.32, 0.5), (0.36, 0.5), 150, -150)],
}  # fmt: skip
LETTERS = tuple(_LETTERS)
"""Letters that can be written."""


@dataclass(frozen=True)
class Path:
    """A pen's path in front of a plane, `RATE` points a second."""

    across: Float[np.ndarray, "t"]
    """To the writer's right [m]."""
    up: Float[np.ndarray, "t"]
    """[m]"""
    off: Float[np.ndarray, "t"]
    """Distance from the plane, towards the writer [m]; zero while the pen writes."""
    stroke: Float[np.ndarray, "t"]
    """Number of the stroke being written, -1 while the pen is lifted."""

    @property
    def down(self) -> Bool[np.ndarray, "t"]:
        """Whether the pen writes."""
        return self.stroke >= 0


def write(word: str, height: float = 0.12, lift: float = 0.04) -> Path:
    """The path of a word, centred, starting and ending with the pen lifted.

    Args:
        word: of `LETTERS`.
        height: of small letters [m].
        lift: how far the pen goes off the plane between strokes [m].
    """
    strokes, begin = [], 0.0
    for letter in word:
        curves = [np.array(points, float) for points in _LETTERS[letter]]
        strokes += [_drawn(curve + [begin, 0.0]) for curve in curves]
        begin += max(float(curve[:, 0].max()) for curve in curves) + _GAP
    pieces = [_approach(strokes[0][0], leave=False)]
    for k, stroke in enumerate(strokes):
        pieces.append(np.column_stack([stroke, np.zeros(len(stroke)), np.full(len(stroke), k)]))
        following = strokes[k + 1][0] if k + 1 < len(strokes) else None
        pieces.append(
            _approach(stroke[-1], leave=True) if following is None else _hop(stroke[-1], following)
        )
    x, y, z, number = np.concatenate(pieces).T
    middle = 0.5 * (begin - _GAP)
    return Path(height * (x - middle), height * (y - 0.5), lift * z, number)


def _drawn(points: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "t 2"]:
    """A smooth curve through points, from rest to rest, slower where it bends."""
    chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    spline = CubicSpline(chord, points)
    at = np.linspace(0.0, chord[-1], _POINTS)
    (dx, dy), (ax, ay) = spline(at, 1).T, spline(at, 2).T
    speed = np.hypot(dx, dy)
    bend = np.abs(dx * ay - dy * ax) / speed**3
    pace = _PACE * (0.3 + bend) ** (1 / 3) * speed
    clock = np.concatenate([[0.0], np.cumsum(0.5 * (pace[1:] + pace[:-1]) * np.diff(at))])
    # The curve's own clock, run through from rest to rest.
    count = int(np.ceil(1.3 * clock[-1] * RATE))
    return spline(np.interp(clock[-1] * _smooth(count), clock, at))


def _smooth(count: int) -> Float[np.ndarray, "count"]:
    """From 0 to 1 with least jerk (Flash and Hogan 1985)."""
    s = np.linspace(0.0, 1.0, count)
    return s**3 * (10 - 15 * s + 6 * s**2)


def _hop(start: np.ndarray, end: np.ndarray) -> Float[np.ndarray, "t 4"]:
    """From the end of a stroke to the start of the next, off the plane in between."""
    count = round(_LIFT_SECONDS * RATE)
    along = _smooth(count)[1:-1, None]
    s = np.linspace(0.0, 1.0, count)[1:-1]
    rise = 64 * (s * (1 - s)) ** 3
    return np.column_stack([start + along * (end - start), rise, np.full(len(s), -1.0)])


def _approach(point: np.ndarray, *, leave: bool) -> Float[np.ndarray, "t 4"]:
    """To the plane at a point, or away from it."""
    count = round(_LIFT_SECONDS * RATE)
    off = _smooth(count)[1:] if leave else 1 - _smooth(count)[:-1]
    return np.column_stack([np.tile(point, (len(off), 1)), off, np.full(len(off), -1.0)])

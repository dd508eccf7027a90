"""How well a motion was retargeted, segment by segment, by C MuJoCo's kinematics."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from mocap_jax.motion.motion import Motion
from mocap_jax.motion.pose_arrays import segment_frames
from mocap_jax.motion.segment_match import SegmentMatch, match_segments

if TYPE_CHECKING:
    import pandas as pd

_NEXT = {
    "Neck": "Head", "Shoulder": "UpperArm", "UpperArm": "ForeArm", "ForeArm": "Hand",
    "UpperLeg": "LowerLeg", "LowerLeg": "Foot", "Foot": "Toe",
}  # fmt: skip
_BENT_AGAINST = {"ForeArm": "UpperArm", "LowerLeg": "UpperLeg"}
COLUMNS = tuple(
    f"{quantity}_{statistic}_{unit}"
    for quantity, unit in (("orientation", "deg"), ("direction", "deg"), ("bend", "deg"),
                           ("position", "cm"))
    for statistic in ("mean", "max")
)  # fmt: skip


def retarget_errors(motion: Motion, fitted: Motion) -> pd.DataFrame:
    """Errors of a retargeted motion against what it was made from.

    Columns, mean and maximum over all frames:

    - `orientation_*_deg`: angle between the segment's orientation and that of the corresponding
      one of `motion` (frames aligned in both rest poses, see `segment_match`).
    - `direction_*_deg`: angle between the lines from the segment's joint to the next one; NaN for
      the trunk and for ends of limbs.
    - `bend_*_deg`: difference of the elbow's (row ForeArm) and the knee's (row LowerLeg) angle
      between the two bones, which depends on no choice of frames; NaN elsewhere.
    - `position_*_cm`: distance of joint centres, each from the middle of its own hips, the clip's
      scaled by the ratio of leg lengths. It holds what the two skeletons differ in.

    Args:
        motion: the clip.
        fitted: what `retarget(motion, body)` returned.

    Returns:
        One row a corresponding segment, and `all` (mean of means, largest maximum).

    Raises:
        InputError: too few segments of the two bodies correspond.
    """
    match = match_segments(motion.body, fitted.body)
    R_source, p_source = _frames(motion, match.source_body)
    R, p = _frames(fitted, match.target_body)
    cosine = _cosine_of_angle(np.swapaxes(R_source @ match.R_source_target, -1, -2) @ R)
    lines, lines_source = _lines(match, p), _lines(match, p_source)
    apart = _from_hips(match, p) - match.scale * _from_hips(match, p_source)
    errors = (
        np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))),
        _angle(lines, lines_source),
        np.abs(_bends(match, lines) - _bends(match, lines_source)),
        100 * np.linalg.norm(apart, axis=-1),
    )
    values = [f(x, axis=0) for x in errors for f in (np.mean, np.max)]
    import pandas as pd

    table = pd.DataFrame(dict(zip(COLUMNS, values, strict=True)), index=list(match.names))
    table.loc["all"] = [table[c].mean() if "mean" in c else table[c].max() for c in COLUMNS]
    return table.rename_axis("segment")


_MEANINGS = """\
orientation: angle between the segment's orientation in the clip and in the retargeted motion,
    once both rest poses are aligned.
direction: angle between the lines from the segment's joint to the next one; "-" for the trunk and
    for ends of limbs, which have no such line.
bend: difference of the elbow's (ForeArm) and the knee's (LowerLeg) angle; "-" for others.
position: distance of joint centres, each from the middle of its hips, the clip scaled by the ratio
    of leg lengths; it holds what the two skeletons differ in, so a perfect fit has some, too."""


def retarget_table(errors: pd.DataFrame, rows: str = "one row a segment") -> str:
    """Errors of `retarget_errors` as a text that explains itself: heading, units, meanings.

    Args:
        errors: with its columns; any index.
        rows: what a row is, for the heading.
    """
    shown = errors.round(1)
    quantities = [c.rsplit("_", 2) for c in shown.columns]
    shown.columns = [f"{name} {statistic} [{unit}]" for name, statistic, unit in quantities]
    heading = (
        f"Errors of retargeting, {rows}: mean and maximum over all frames;\n"
        "over several segments (row `all`) the mean of the means and the largest maximum."
    )
    names = shown.index.nlevels > 1
    table = shown.to_string(na_rep="-", index_names=names)
    return f"{heading}\n\n{table}\n\n{_MEANINGS}"


def _frames(motion: Motion, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return segment_frames(motion.body, np.asarray(motion.trajectory.q), chosen)


def _cosine_of_angle(R: Float[np.ndarray, "*b 3 3"]) -> Float[np.ndarray, "*b"]:
    return (np.trace(R, axis1=-2, axis2=-1) - 1) / 2


def _from_hips(match: SegmentMatch, p: Float[np.ndarray, "t n 3"]) -> Float[np.ndarray, "t n 3"]:
    hips = [match.names.index(f"{side}UpperLeg") for side in ("Left", "Right")]
    return p - p[:, hips].mean(axis=1, keepdims=True)


def _lines(match: SegmentMatch, p: Float[np.ndarray, "t n 3"]) -> Float[np.ndarray, "t n 3"]:
    """From each segment's joint to the next one's; NaN where none follows."""
    result = np.full_like(p, np.nan)
    for i, name in enumerate(match.names):
        side = next((s for s in ("Left", "Right") if name.startswith(s)), "")
        following = side + _NEXT.get(name.removeprefix(side), "none")
        if following in match.names:
            result[:, i] = p[:, match.names.index(following)] - p[:, i]
    return result


def _angle(a: Float[np.ndarray, "*b 3"], b: Float[np.ndarray, "*b 3"]) -> Float[np.ndarray, "*b"]:
    """Angle between vectors [deg]."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1)))


def _bends(match: SegmentMatch, lines: Float[np.ndarray, "t n 3"]) -> Float[np.ndarray, "t n"]:
    """Angle [deg] between upper arm and forearm, thigh and shank; NaN for other segments."""
    result = np.full(lines.shape[:2], np.nan)
    for i, name in enumerate(match.names):
        part = name.removeprefix("Left").removeprefix("Right")
        before = name.removesuffix(part) + _BENT_AGAINST.get(part, "none")
        if before in match.names:
            result[:, i] = _angle(lines[:, match.names.index(before)], lines[:, i])
    return result

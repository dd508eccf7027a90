"""`UserResidual`: plain functions of a window of poses, the user's own and those of the body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jax import Array

from mocap_jax.errors import InputError

KNEES = "knees"
"""Name of the residual that `knees` adds: it moves nothing that boards do not hold."""
COUPLINGS = "couplings"
"""Name of the residual that `coupled` adds; the same holds of it."""


@dataclass(frozen=True)
class UserResidual:
    """A residual of the user's own: a plain function of a window of poses.

    `function(body, q_window, data) -> (m,)` is already whitened; `q_window` has shape (w, nq) and
    holds frames k .. k + w - 1; `data` is the row k of `data` (any pytree of arrays).
    """

    name: str
    function: Callable[..., Array]
    window: int = 1


# Names under which other residuals of a pose count.
_TAKEN = {COUPLINGS, KNEES, "accelerometer", "gyroscope", "orientation", "range", "reference",
          "limits", "smoothness", "pose_prior", "contact", "gravity"}  # fmt: skip


def check_names(residuals: tuple[UserResidual, ...]) -> None:
    """Raise `InputError` where the name of one is taken."""
    names = [r.name for r in residuals]
    for name in names:
        if name in _TAKEN or names.count(name) > 1:
            raise InputError(
                f"user residual '{name}': the name is taken; every one needs a name of its own, "
                f"none of {', '.join(sorted(_TAKEN))}"
            )


def data_of(residuals: tuple[UserResidual, ...], user_data: tuple) -> tuple:
    """Data of the user's residuals; nothing for all of them where none is given.

    Raises:
        InputError: not one entry for each.
    """
    given = user_data or (None,) * len(residuals)
    if len(given) != len(residuals):
        raise InputError(
            f"user_data has {len(given)} entries for {len(residuals)} user residuals "
            f"({', '.join(r.name for r in residuals) or 'none'}); give one for each, None without"
        )
    return given


def frame_step(time: np.ndarray, what: str) -> float:
    """Interval between the frames (t,) [s] of a residual that is made for them.

    Raises:
        InputError: fewer than two frames.
    """
    frames = np.asarray(time)
    if frames.ndim != 1 or len(frames) < 2:
        raise InputError(f"{what}: time has shape {frames.shape}; it must hold two frames or more")
    return float(frames[1] - frames[0])


def mask_of(residual: UserResidual, frames: int) -> np.ndarray:
    """Weight (t,) of each window, by its first frame: zero where it leaves the sequence."""
    mask = np.ones(frames)
    mask[frames - residual.window + 1 :] = 0.0
    return mask

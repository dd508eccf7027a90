"""Motions that come with the package."""

from __future__ import annotations

import jax.numpy as jnp

from mocap_jax.body import Body
from mocap_jax.errors import unknown_name
from mocap_jax.motion.human import human
from mocap_jax.motion.motion import Motion
from mocap_jax.motion.routine import RATE as ROUTINE_RATE
from mocap_jax.motion.routine import routine_poses
from mocap_jax.motion.walking import RATE as WALKING_RATE
from mocap_jax.motion.walking import walking_poses
from mocap_jax.trajectory import Trajectory

_BUILTIN = {"routine": (routine_poses, ROUTINE_RATE), "walking": (walking_poses, WALKING_RATE)}
BUILTIN_MOTIONS: tuple[str, ...] = tuple(_BUILTIN)
"""Names that `builtin_motion` knows."""


def builtin_motion(name: str, body: Body | None = None) -> Motion:
    """A motion that needs no file.

    Args:
        name: "routine" (30 s, every joint through most of its range, for any body; it starts and
            ends at rest in qpos0) or "walking" (10 s along X at 1.3 m/s, for bodies of `human`).
        body: who performs it; `human()` by default.

    Raises:
        InputError: unknown name, or a body that cannot walk.
    """
    if name not in _BUILTIN:
        raise unknown_name("built-in motion", name, BUILTIN_MOTIONS)
    body = human() if body is None else body
    poses, rate = _BUILTIN[name]
    time, q = poses(body)
    facts: dict[str, str | float | int | bool] = {"built_in": name, "frame_rate_hz": rate}
    return Motion(name, body, Trajectory(jnp.asarray(time), jnp.asarray(q)), facts)

"""Bodies of `--body` that are files: MJCF, OpenSim models, and skeletons of joint positions."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mocap_jax.body import Body


def is_skeleton(path: str | None) -> bool:
    """Whether a value of `--body` is a file of joint positions, by its suffix."""
    from mocap_jax.motion import JOINT_SUFFIXES

    return path is not None and path.lower().endswith(JOINT_SUFFIXES)


def read_body(path: str, *, free_root: bool | None = None) -> Body:
    """An MJCF body, an OpenSim model or a skeleton."""
    from mocap_jax.body import load_body
    from mocap_jax.motion import load_skeleton

    return load_skeleton(path) if is_skeleton(path) else load_body(path, free_root=free_root)

"""Bodies of `--body` that are files: MJCF, OpenSim models, and skeletons of joint positions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.cli.human_text import HUMAN_FORM

if TYPE_CHECKING:
    from mocap_jax.body import Body


def is_skeleton(path: str | None) -> bool:
    """Whether a value of `--body` is a file of joint positions, by its suffix."""
    from mocap_jax.motion import JOINT_SUFFIXES

    return path is not None and path.lower().endswith(JOINT_SUFFIXES)


def check_body(value: str) -> None:
    """Refuse a value of `--body` that looks like a name, not a file, and is not there."""
    if not Path(value).suffix and not Path(value).exists():
        raise UsageError(
            f"--body {value}: neither a file nor a built-in body; valid: a file (.xml, .osim or a "
            f"skeleton), {HUMAN_FORM}"
        )


def read_body(path: str, *, free_root: bool | None = None) -> Body:
    """An MJCF body, an OpenSim model or a skeleton."""
    from mocap_jax.body import load_body
    from mocap_jax.motion import load_skeleton

    return load_skeleton(path) if is_skeleton(path) else load_body(path, free_root=free_root)

"""Motion clips by name: built-in ones, files, and the CMU clips of MOCAP_JAX_DATA."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).resolve().parents[1]
# Facts about the clips that their files do not state or state wrongly (the database's index).
TRUE_RATE = {"60_13_salsa_60Hz.bvh": 60.0}


def folder() -> Path:
    """Where the CMU clips are (default `../shared/data/cmu_mocap`)."""
    return Path(os.environ.get("MOCAP_JAX_DATA", _ROOT.parent / "shared" / "data")) / "cmu_mocap"


def all_clips() -> list[str]:
    """All CMU clips; exits where there are none."""
    clips = sorted(str(f) for f in folder().glob("*") if f.suffix in (".amc", ".bvh"))
    if not clips:
        sys.exit(f"no clips in {folder()}; set MOCAP_JAX_DATA or name the clips")
    return clips


def load_clip(name: str) -> Any:
    """A built-in motion, a file, or a CMU clip by its file name alone."""
    import mocap_jax as mj

    if name in mj.BUILTIN_MOTIONS:
        return mj.builtin_motion(name)
    path = Path(name) if Path(name).exists() else folder() / name
    return mj.load_motion(path if path.exists() else name, fps=TRUE_RATE.get(path.name))


def subject_of(name: str) -> str:
    """The subject's number: what a clip's name has before its first underscore."""
    return Path(name).stem.split("_")[0]

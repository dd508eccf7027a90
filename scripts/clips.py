"""Motion clips by name: built-in ones, files, and the CMU clips of MOCAP_JAX_DATA."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).resolve().parents[1]
CLIP_SUFFIXES = (".amc", ".bvh")
"""Of the CMU clips."""
# Facts about the clips that their files do not state or state wrongly (the database's index).
TRUE_RATE = {"60_13_salsa_60Hz.bvh": 60.0}


def folder() -> Path:
    """Where the CMU clips are (default `../shared/data/cmu_mocap`)."""
    return Path(os.environ.get("MOCAP_JAX_DATA", _ROOT.parent / "shared" / "data")) / "cmu_mocap"


def all_clips() -> list[str]:
    """All CMU clips; exits where there are none."""
    clips = sorted(str(f) for f in folder().glob("*") if f.suffix in CLIP_SUFFIXES)
    if not clips:
        sys.exit(f"no clips in {folder()}; set MOCAP_JAX_DATA or name the clips")
    return clips


def chosen_clips(value: str, suffixes: tuple[str, ...] = CLIP_SUFFIXES) -> list[str]:
    """Type of an argument: built-in motions, files, or CMU clips by name, after commas.

    Args:
        value: what was given.
        suffixes: of the CMU clips that count; the first may be left out.
    """
    from mocap_jax import BUILTIN_MOTIONS

    clips = {f.name: str(f) for f in sorted(folder().glob("*")) if f.suffix in suffixes}
    chosen = []
    for name in value.split(","):
        if name in BUILTIN_MOTIONS or Path(name).is_file():
            chosen.append(name)
        elif name in clips or f"{name}{suffixes[0]}" in clips:
            chosen.append(clips.get(name) or clips[f"{name}{suffixes[0]}"])
        else:
            valid = ", ".join([*BUILTIN_MOTIONS, *clips, "a motion file"])
            raise argparse.ArgumentTypeError(f"'{name}'; valid: {valid}")
    return chosen


def load_clip(name: str, seconds: float | None = None) -> Any:
    """A built-in motion, a file, or a CMU clip by its file name alone; or its beginning."""
    import mocap_jax as mj

    if name in mj.BUILTIN_MOTIONS:
        motion = mj.builtin_motion(name)
    else:
        path = Path(name) if Path(name).exists() else folder() / name
        motion = mj.load_motion(path if path.exists() else name, fps=TRUE_RATE.get(path.name))
    return motion if seconds is None else mj.cut_motion(motion, 0.0, seconds)


def subject_of(name: str) -> str:
    """The subject's number: what a clip's name has before its first underscore."""
    return Path(name).stem.split("_")[0]

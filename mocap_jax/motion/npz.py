"""Motion as NumPy arrays (`.npz`): `time`, `q` and `body_xml`, as `export_motion` writes them."""

from __future__ import annotations

from pathlib import Path

import jax.numpy as jnp
import numpy as np

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.motion.motion import Motion
from mocap_jax.motion.npz_arrays import read_arrays
from mocap_jax.trajectory import Trajectory

_KEYS = ("time", "q", "body_xml")


def load_npz(path: Path, *, fps: float | None = None, skip: int | None = None) -> Motion:
    """Load a motion from arrays; see `load_motion`."""
    arrays = _read(path)
    body = load_body(str(arrays["body_xml"]))
    time, q = np.asarray(arrays["time"], float), np.asarray(arrays["q"], float)
    if q.ndim != 2 or q.shape[1] != body.nq or time.shape != q.shape[:1]:
        raise InputError(
            f"{path}: time {time.shape} and q {q.shape} must be (t,) and (t, {body.nq})"
        )
    if not (np.isfinite(q).all() and np.isfinite(time).all()):
        raise InputError(f"{path}: time or q holds a value that is not finite")
    time, q = time[skip or 0 :], q[skip or 0 :]
    if not len(time):
        raise InputError(f"{path}: no frames (skipped {skip or 0})")
    if fps is not None:
        time = np.arange(len(time)) / fps
    elif (np.diff(time) <= 0).any():
        raise InputError(f"{path}: time must increase")
    rate = float(1 / np.diff(time).mean()) if len(time) > 1 else 0.0
    facts: dict[str, str | float | int | bool] = {
        "file": path.name, "skipped_frames": skip or 0, "frame_rate_hz": rate,
    }  # fmt: skip
    trajectory = Trajectory(jnp.asarray(time - time[0]), jnp.asarray(q))
    return Motion(path.stem, body, trajectory, facts)


def _read(path: Path) -> dict[str, np.ndarray]:
    arrays = read_arrays(path, _KEYS)
    missing = [key for key in _KEYS if key not in arrays]
    if missing:
        raise InputError(f"{path}: no array '{missing[0]}'; needed: {', '.join(_KEYS)}")
    return arrays

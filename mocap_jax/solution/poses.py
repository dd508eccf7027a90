"""World poses of all segments over time, in chunks of one size so that JAX compiles once."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, Topology, frames
from mocap_jax.stored_programs import StoredProgram

CHUNK = 512


def map_frames(compiled: Callable[..., Any], fixed: tuple, *arrays: np.ndarray) -> Any:
    """Apply a batched, jitted function to arrays of any length in chunks of `CHUNK` frames.

    Args:
        compiled: function of (*fixed, *chunks) whose outputs have the frame axis first.
        fixed: arguments that are the same for every chunk.
        arrays: arrays with the frame axis first; the last chunk repeats the last frame.

    Returns:
        The outputs as NumPy arrays, with the frame axis first.
    """
    count = len(arrays[0])
    pieces = []
    for start in range(0, max(count, 1), CHUNK):
        chunk = [_padded(np.asarray(a)[start : start + CHUNK]) for a in arrays]
        pieces.append(jax.tree.map(np.asarray, compiled(*fixed, *chunk)))
    return jax.tree.map(lambda *parts: np.concatenate(parts)[:count], *pieces)


def _padded(chunk: np.ndarray) -> np.ndarray:
    missing = CHUNK - len(chunk)
    if not missing:
        return chunk
    filler = chunk[-1:] if len(chunk) else np.zeros((1, *chunk.shape[1:]), chunk.dtype)
    return np.concatenate([chunk, np.repeat(filler, missing, axis=0)])


@StoredProgram
def _chunk_poses(body: Body, q: jax.Array) -> tuple[jax.Array, jax.Array]:
    f = jax.vmap(lambda one: frames(body, one))(q)
    return f.rotation, f.position


def segment_poses(
    body: Body, q: Float[np.ndarray, "t nq"]
) -> tuple[Float[np.ndarray, "t nbody 3 3"], Float[np.ndarray, "t nbody 3"]]:
    """World rotations (`R_world_segment`) and positions [m] of all segments over time."""
    # The text of the model is part of the compilation key and has no part in the kinematics.
    return map_frames(_chunk_poses, (dataclasses.replace(body, xml=""),), np.asarray(q))


def joint_segments(topology: Topology) -> list[int]:
    """Bodies that a joint (other than a free one) connects to their parent, in order."""
    return sorted(
        {b for b, kind in zip(topology.joint_body, topology.joint_types, strict=True)
         if kind != "free"}
    )  # fmt: skip


def root_segment(topology: Topology) -> int:
    """The first body below the world (the Pelvis of a human body)."""
    return topology.body_parent.index(0, 1)


def dof_names(topology: Topology) -> tuple[str, ...]:
    """A name per degree of freedom: the joint's, with `:x` and the like where it has several."""
    suffixes = {
        "free": ("px", "py", "pz", "rx", "ry", "rz"),
        "ball": ("rx", "ry", "rz"),
    }
    return tuple(
        f"{name}:{s}" if s else name
        for name, kind in zip(topology.joint_names, topology.joint_types, strict=True)
        for s in suffixes.get(kind, ("",))
    )

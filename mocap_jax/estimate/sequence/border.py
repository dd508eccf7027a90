"""`Border`: the coupling of poses and sensor constants, spread out only where it is read."""

from __future__ import annotations

import jax
import numpy as np
from jaxtyping import Float

from mocap_jax.estimate.sequence.assemble import chunk_border
from mocap_jax.estimate.sequence.layout import Layout
from mocap_jax.estimate.sequence.window import sensor_dofs


class Border:
    """Blocks of B' by frame, made chunk by chunk when asked for in order; and products with B."""

    def __init__(self, layout: Layout, compact: list[tuple[np.ndarray, ...]], frames: int) -> None:
        self._layout, self._frames = layout, frames
        self._compact = compact
        """What `chunk_border` takes, chunk by chunk."""
        self._ahead: dict[int, jax.Array] = {}
        self._chunk = -1
        self._blocks = np.zeros((0, 0, 0))

    def prepare(self, index: int, blocks: jax.Array) -> None:
        """Hand over blocks of a chunk that are being computed, to be read before the next's."""
        self._ahead = {index: blocks}

    def __call__(self, k: int) -> np.ndarray:
        index, row = divmod(k, self._layout.chunk)
        if index != self._chunk:
            ahead = self._ahead.pop(index, None)
            self._blocks = np.asarray(
                chunk_border(self._layout, *self._compact[index]) if ahead is None else ahead
            )
            self._chunk = index
        return self._blocks[row]

    def times(self, z: Float[np.ndarray, "m"]) -> Float[np.ndarray, "t nv"]:
        """B z: wrenches on the sensors, and from them forces on the degrees of freedom."""
        own, shared = self._split(z)
        mask = sensor_dofs(self._layout).astype(float)

        def chunk(
            twist: np.ndarray, screws: np.ndarray, ranges: np.ndarray, geometry: np.ndarray
        ) -> np.ndarray:
            wrench = np.stack([twist[:, s] @ own[s] for s in range(len(mask))], axis=-1)
            offsets = own[:, self._layout.sensor_cells["offset"]].ravel()
            out = ((wrench @ mask) * screws).sum(axis=1)
            out += offsets @ ranges.reshape(len(out), -1, out.shape[1])
            return out + shared @ geometry

        return np.concatenate([chunk(*parts) for parts in self._compact])[: self._frames]

    def pulled(self, x: Float[np.ndarray, "t nv"]) -> Float[np.ndarray, "m"]:
        """B'x: twists of the sensors, and what these do with the sensors' constants."""
        layout, mask = self._layout, sensor_dofs(self._layout).astype(float)
        own = np.zeros((len(mask), layout.per_sensor))
        offset, shared = own[:, layout.sensor_cells["offset"]], np.zeros(layout.geometry)
        rows = np.zeros((len(self._compact), layout.chunk, x.shape[1]))
        rows.reshape(-1, x.shape[1])[: self._frames] = x
        for step, (twist, screws, ranges, geometry) in zip(rows, self._compact, strict=True):
            moved = (screws * step[:, None]) @ mask.T
            for s in range(len(mask)):
                own[s] += np.tensordot(moved[:, :, s], twist[:, s], 2)
            column = step[..., None]
            told = ranges.reshape(len(step), -1, x.shape[1]) @ column
            offset += told.sum(axis=0).reshape(offset.shape)
            shared += (geometry @ column).sum(axis=0)[:, 0]
        return np.concatenate([own.ravel(), shared])

    def _split(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Constants of the sensors (s, n), and of none of them."""
        count = self._layout.per_sensor * len(self._layout.sites)
        return z[:count].reshape(-1, self._layout.per_sensor), z[count:]

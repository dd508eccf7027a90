"""`Border`: the coupling of poses and sensor constants, spread out only where it is read."""

from __future__ import annotations

import jax
import numpy as np

from mocap_jax.estimate.sequence.assemble import chunk_border
from mocap_jax.estimate.sequence.layout import Layout


class Border:
    """Blocks of B' by frame, made chunk by chunk when asked for in order."""

    def __init__(self, layout: Layout, compact: list[tuple[np.ndarray, ...]]) -> None:
        self._layout = layout
        self._compact = compact
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

"""`ChunkedTerms`: measurements of all frames, cut into chunks of one shape with halos."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.estimate.sequence.layout import (
    Layout,
    Terms,
    by_field,
    frame_axis,
    repeats_at_ends,
)


class ChunkedTerms:
    """Arrays of t frames, padded so that every chunk has a halo."""

    def __init__(self, layout: Layout, terms: Terms, dtype: np.dtype) -> None:
        self.layout, self.dtype = layout, dtype
        self.frames = terms.force.shape[0]
        self.count = -(-self.frames // layout.chunk)
        """Number of chunks."""
        self.padded = by_field(terms, self._padded)
        self._cuts: list[Terms] | None = None

    def _padded(self, name: str, x: np.ndarray) -> np.ndarray:
        edge = repeats_at_ends(name)
        return pad_frames(np.asarray(x), self.layout, self.count, frame_axis(name), edge=edge)

    @property
    def whole(self) -> Terms:
        """All frames, without padding."""
        return _rows(self.padded, self.layout.halo, self.layout.halo + self.frames)

    def replace(self, **changes: np.ndarray | tuple[np.ndarray, ...]) -> None:
        """Exchange measurement or information arrays of (t, ...) frames."""

        def pad(name: str, value: np.ndarray) -> np.ndarray:
            return pad_frames(value, self.layout, self.count, frame_axis(name), edge=False)

        padded: dict[str, Any] = {
            name: jax.tree.map(lambda x, name=name: pad(name, x), value)
            for name, value in changes.items()
        }
        self.padded = dataclasses.replace(self.padded, **padded)
        self._cuts = None

    def chunk(self, index: int) -> Terms:
        """One chunk with its halo, as JAX arrays."""
        first = index * self.layout.chunk
        return cast(_rows(self.padded, first, first + self._length), self.dtype)

    def with_poses(
        self, q: Float[np.ndarray, "t nq"]
    ) -> Iterator[tuple[Float[np.ndarray, "n nq"], Terms]]:
        """Poses and measurements, chunk by chunk."""
        # Cut in NumPy: slicing two dozen JAX arrays one by one costs as much as the cost itself.
        q = pad_frames(np.asarray(q, self.dtype), self.layout, self.count, 0, edge=True)
        if self._cuts is None:
            self._cuts = [self.chunk(i) for i in range(self.count)]
        for i, terms in enumerate(self._cuts):
            first = i * self.layout.chunk
            yield q[first : first + self._length], terms

    @property
    def _length(self) -> int:
        """Frames of a chunk, halos included."""
        return self.layout.chunk + 2 * self.layout.halo


def _rows(tree: Terms, first: int, last: int) -> Terms:
    """Frames `first` to `last` of all arrays."""

    def rows(name: str, x: Array) -> Array:
        return x[:, first:last] if frame_axis(name) else x[first:last]

    return by_field(tree, rows)


def pad_frames(x: np.ndarray, layout: Layout, chunks: int, axis: int, *, edge: bool) -> np.ndarray:
    """Pad the frame axis by the halo in front and up to whole chunks plus a halo behind."""
    total = chunks * layout.chunk + 2 * layout.halo
    widths = [(0, 0)] * x.ndim
    widths[axis] = (layout.halo, total - layout.halo - x.shape[axis])
    return np.pad(x, widths, mode="edge" if edge else "constant")


def cast(tree: Any, dtype: np.dtype) -> Any:
    """Floating arrays of a pytree to one dtype, as JAX arrays."""

    def one(x: Any) -> jax.Array:
        # NumPy converts without compiling; `asarray` of the result is a plain copy.
        floating = jnp.issubdtype(x.dtype, jnp.floating)
        return jnp.asarray(np.asarray(x, dtype) if floating else x)

    return jax.tree.map(one, tree)

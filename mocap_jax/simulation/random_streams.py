"""Independent random streams, one per effect, all from one seed."""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, effect: str) -> np.random.Generator:
    """Random numbers of one effect; switching another effect on or off leaves them unchanged."""
    return np.random.default_rng([seed, zlib.crc32(effect.encode())])

"""Named arrays as the bytes of an NPZ file, whatever their names and without pickles."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

import numpy as np


def pack_arrays(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Bytes of an NPZ file; unlike `np.savez`, any name is allowed ("file", for one)."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            content = io.BytesIO()
            np.lib.format.write_array(content, np.asanyarray(array), allow_pickle=False)
            # ZipInfo's fixed date makes equal arrays give equal bytes.
            entry = zipfile.ZipInfo(f"{name}.npy")
            archive.writestr(entry, content.getvalue(), zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def unpack_arrays(raw: bytes) -> dict[str, np.ndarray]:
    """Arrays by name.

    Raises:
        ValueError: the bytes are damaged.
    """
    try:
        with np.load(io.BytesIO(raw), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (zipfile.BadZipFile, EOFError, KeyError, OSError, NotImplementedError) as error:
        raise ValueError(f"damaged array archive: {error}") from error

"""HDF5 files, with one clear error where they or `h5py` are missing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mocap_jax.errors import InputError


@contextmanager
def open_hdf5(file: Path) -> Iterator[Any]:
    """Open an HDF5 file for reading.

    Raises:
        InputError: missing, not HDF5, truncated, or `h5py` is not installed.
    """
    try:
        import h5py
    except ImportError as error:
        raise InputError(
            f"{file}: HDF5 needs the package h5py (pip install 'mocap_jax[convert]')"
        ) from error
    if not file.is_file():
        raise InputError(f"{file}: no such file")
    try:
        document = h5py.File(file, "r")
    except OSError as error:
        raise InputError(
            f"{file}: not a readable HDF5 file (truncated?): {_one_line(error)}"
        ) from error
    with document:
        try:
            yield document
        except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
            raise InputError(f"{file}: a damaged HDF5 file: {_one_line(error)}") from error


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())

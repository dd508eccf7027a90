"""Arrays by name out of an NPZ file that a user gives."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mocap_jax.errors import InputError


def read_arrays(path: Path, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Those of the named arrays that the file holds.

    Raises:
        InputError: the file is missing, damaged or no NPZ file, or an array holds Python objects.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    if not zipfile.is_zipfile(path):  # NumPy would take it for a pickle and advise to trust it
        raise InputError(f"{path}: not a readable NPZ file: no archive of arrays, or cut short")
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in names if name in archive}
    except ValueError as error:
        if "allow_pickle" in str(error):
            raise InputError(f"{path}: an array holds Python objects, not numbers") from error
        raise InputError(f"{path}: not a readable NPZ file: {error}") from error
    except (OSError, zipfile.BadZipFile, EOFError) as error:
        raise InputError(f"{path}: not a readable NPZ file: {error}") from error

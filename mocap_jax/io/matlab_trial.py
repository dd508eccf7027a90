"""MATLAB files of public data sets, whose content is known beforehand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from mocap_jax.errors import InputError


def load_trial(path: Path, data_set: str) -> dict[str, Any]:
    """All variables of a trial; structures as dictionaries.

    Args:
        path: `.mat` file.
        data_set: of which a trial is expected.

    Raises:
        InputError: no such file, or not a MATLAB file.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file (expected a .mat trial of {data_set})")
    try:
        return loadmat(path, simplify_cells=True)
    except (MatReadError, ValueError, NotImplementedError, OSError) as error:
        raise InputError(f"{path}: not a readable MATLAB file: {error}") from error

"""Pose priors as JSON files."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.pose_prior.prior import PosePrior

_NEEDED = ("joints", "mean", "covariance", "correlation_time")
# Significant ones: enough to keep a covariance positive definite down to tiny floors.
_DIGITS = 9


def save_pose_prior(path: str | os.PathLike[str], prior: PosePrior) -> None:
    """Write a prior, whole or not at all."""
    from mocap_jax.io.atomic import atomic_file  # all of `io` comes with it

    document: dict[str, object] = {
        "name": prior.name,
        "provenance": prior.provenance,
        "correlation_time": prior.correlation_time,
        "joints": [list(joint) for joint in prior.joints],
        "mean": _rounded(prior.mean).tolist(),
        "covariance": _triangle(prior.covariance),
    }
    if prior.mobility is not None:
        document["mobility"] = _triangle(prior.mobility)
    with atomic_file(path) as stream:
        stream.write((json.dumps(document, indent=None) + "\n").encode())


def load_pose_prior(path: str | os.PathLike[str]) -> PosePrior:
    """Read a prior, for example one of your own.

    The file is JSON: `joints` (pairs of child and parent segment, Xsens names), `mean` (quaternions
    wxyz of the child's anatomical frame in the parent's), `covariance` (of the rotation vectors
    about it [rad^2]: the whole matrix, or its lower triangle row by row), `correlation_time` [s],
    and, if you like, `mobility` (like `covariance`, [rad^2/s]), `name` and `provenance`.

    Raises:
        InputError: no such file, not JSON, an entry missing, or values that are no prior.
    """
    document = _parse(Path(path))
    missing = [key for key in _NEEDED if key not in document]
    if missing:
        raise InputError(f"{path}: '{missing[0]}' is missing; needed are {', '.join(_NEEDED)}")
    try:
        joints = tuple((str(c), str(p)) for c, p in document["joints"])
        return PosePrior(
            joints, np.array(document["mean"], float).reshape(-1, 4),
            _matrix(document["covariance"], 3 * len(joints)),
            float(document["correlation_time"]), _mobility(document, 3 * len(joints)),
            str(document.get("name", Path(path).stem)),
            dict(document.get("provenance", {})),
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: not a pose prior: {error}") from error


def _parse(path: Path) -> dict:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot read: {error.strerror or error}") from error
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON: {error}") from error
    if not isinstance(document, dict):
        raise InputError(f"{path}: not a pose prior: expected an object with {', '.join(_NEEDED)}")
    return document


def _mobility(document: dict, size: int) -> np.ndarray | None:
    return _matrix(document["mobility"], size) if "mobility" in document else None


def _triangle(matrix: np.ndarray) -> list[float]:
    return _rounded(matrix[np.tril_indices(len(matrix))]).tolist()


def _rounded(values: np.ndarray) -> np.ndarray:
    return np.vectorize(lambda x: float(f"{x:.{_DIGITS}g}"), otypes=[float])(values)


def _matrix(values: object, size: int) -> np.ndarray:
    given = np.array(values, float)
    if given.ndim != 1:
        return given
    matrix = np.zeros((size, size))
    matrix[np.tril_indices(size)] = given
    return matrix + np.tril(matrix, -1).T

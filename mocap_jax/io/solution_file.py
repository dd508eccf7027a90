"""Solutions as MCAP files."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from enum import Enum
from typing import Any

import numpy as np
from jax import device_put

from mocap_jax.body import Body, load_body
from mocap_jax.errors import InputError
from mocap_jax.io.array_archive import pack_arrays, unpack_arrays
from mocap_jax.io.mcap_covariance import add_covariances, read_covariances
from mocap_jax.io.mcap_read import DAMAGE, Contents, read_contents
from mocap_jax.io.mcap_trajectory import add_trajectory, read_trajectory
from mocap_jax.io.mcap_write import FORMAT_VERSION, METADATA_NAME, McapFile
from mocap_jax.io.recording_reader import kind_of
from mocap_jax.io.setup_toml import setup_from_toml, setup_to_toml
from mocap_jax.solution import Solution, Status

_PREFIX = "/solution"
_JSON, _BODY_ARRAYS = "solution.json", "body_arrays.npz"


def write_solution(path: str | os.PathLike[str], solution: Solution) -> None:
    """Write a solution to an MCAP file, whole or not at all.

    Values keep all their digits; times are rounded to whole nanoseconds. The absolute start is
    `setup.provenance["start_utc_ns"]` where that is given, else 0.

    Raises:
        InputError: the file cannot be written, or the trajectory does not fit the body.
    """
    start = solution.setup.provenance.get("start_utc_ns", 0)
    file = McapFile("solution", int(start), {"method": solution.method})
    file.attach("body.xml", "application/xml", solution.body.xml)
    file.attach("setup.toml", "application/toml", setup_to_toml(solution.setup))
    file.attach(_JSON, "application/json", json.dumps(_summary(solution), allow_nan=False))
    _attach_changed_arrays(file, solution.body)
    add_trajectory(file, _PREFIX, solution.body, solution.trajectory)
    add_covariances(file, solution)
    file.write(path)


def read_solution(path: str | os.PathLike[str]) -> Solution:
    """Read a solution from an MCAP file; losses of a damaged one are added to its remarks.

    Sequences in `options` come back as tuples.

    Raises:
        InputError: not an MCAP file, not a solution, or its body or trajectory are lost.
    """
    return solution_from(path, read_contents(path))


def solution_from(path: str | os.PathLike[str], contents: Contents) -> Solution:
    """Make the solution of a file's contents (see `read_solution`)."""
    _refuse_foreign(path, contents)
    try:
        return _solution(path, contents)
    except InputError as error:
        raise InputError(f"{path}: {error}" if str(path) not in str(error) else str(error)) from (
            error
        )
    except DAMAGE as error:
        raise InputError(f"{path}: the solution is damaged: {error!r}") from error


def _refuse_foreign(path: str | os.PathLike[str], contents: Contents) -> None:
    version = contents.metadata.get(METADATA_NAME, {}).get("format_version", "1")
    if version.isdigit() and int(version) > FORMAT_VERSION:
        raise InputError(
            f"{path}: written in format version {version}; this software reads up to "
            f"{FORMAT_VERSION} (update mocap_jax)"
        )
    if kind_of(contents) != "solution":
        raise InputError(f"{path}: this is a recording, not a solution (reconstruct it first)")


def _solution(path: str | os.PathLike[str], contents: Contents) -> Solution:
    lost = list(contents.damage)
    for needed in ("body.xml", _JSON):
        if needed not in contents.attachments:
            raise InputError(f"attachment {needed} is absent{_because(lost)}")
    body = _read_body(contents)
    trajectory = read_trajectory(contents, _PREFIX, body.topology)
    trajectory, covariance, pairs, missing = read_covariances(contents, trajectory)
    lost += missing
    summary = _restore(json.loads(contents.attachments[_JSON]))
    setup = contents.attachments.get("setup.toml", b"").decode()
    arrays = lambda key: {k: np.array(v, np.float64) for k, v in summary[key].items()}  # noqa: E731
    return Solution(
        trajectory=trajectory,
        body=body,
        status=Status[summary["status"]],
        method=summary["method"],
        setup=setup_from_toml(setup, f"{path}: setup.toml"),
        remarks=tuple(summary["remarks"]) + tuple(f"Salvaged: {text}." for text in lost),
        covariance=covariance,
        pair_covariance=pairs,
        observed=tuple(summary["observed"]),
        cost=tuple(summary["cost"]),
        iterations=summary["iterations"],
        seconds_solve=summary["seconds_solve"],
        seconds_compile=summary["seconds_compile"],
        statistics=summary["statistics"],
        innovations=summary.get("innovations", {}),
        calibration=arrays("calibration"),
        calibration_std=arrays("calibration_std"),
        options=summary["options"],
    )


def _because(lost: list[str]) -> str:
    return f" ({'; '.join(lost)})" if lost else ""


# The body: its XML, and what was estimated of it


def _array_fields() -> list[str]:
    return [f.name for f in dataclasses.fields(Body) if not f.metadata.get("static")]


def _attach_changed_arrays(file: McapFile, body: Body) -> None:
    """Store the arrays that are no longer those of the XML (estimated lengths, mountings)."""
    nominal = load_body(body.xml)
    changed = {}
    for name in _array_fields():
        value = np.asarray(getattr(body, name), np.float64)
        if not np.array_equal(value, np.asarray(getattr(nominal, name))):
            changed[name] = value
    if changed:
        file.attach(_BODY_ARRAYS, "application/octet-stream", pack_arrays(changed))


def _read_body(contents: Contents) -> Body:
    body = load_body(contents.attachments["body.xml"].decode())
    if _BODY_ARRAYS not in contents.attachments:
        return body
    arrays = unpack_arrays(contents.attachments[_BODY_ARRAYS])
    return body.replace(**{name: device_put(value) for name, value in arrays.items()})


# Everything else, as JSON. Its numbers are finite, so others are written as text.

_SPECIAL = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf}


def _summary(solution: Solution) -> dict[str, Any]:
    plain = (
        "method", "remarks", "observed", "cost", "iterations", "seconds_solve", "seconds_compile",
        "statistics", "innovations", "calibration", "calibration_std", "options",
    )  # fmt: skip
    return {
        "status": solution.status.name,
        "status_text": solution.status.value,
        **{name: _plain(getattr(solution, name)) for name in plain},
    }


def _plain(value: Any) -> Any:
    """A value as JSON holds it."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Enum):
        return value.name
    if hasattr(value, "tolist"):  # NumPy and JAX arrays and scalars.
        return _plain(value.tolist())
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(v) for v in value]
    if isinstance(value, float) and not math.isfinite(value):
        return {"number": "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"}
    return value if isinstance(value, str | float | int | bool | None) else str(value)


def _restore(value: Any) -> Any:
    if isinstance(value, dict):
        if set(value) == {"number"} and value["number"] in _SPECIAL:
            return _SPECIAL[value["number"]]
        return {k: _restore(v) for k, v in value.items()}
    return tuple(_restore(v) for v in value) if isinstance(value, list) else value

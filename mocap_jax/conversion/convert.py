"""`convert`: other systems' recordings to a `Recording`, checked for what is wrong with them."""

from __future__ import annotations

import dataclasses
import os
import warnings
from collections.abc import Sequence
from pathlib import Path

from mocap_jax.body import Body, load_body
from mocap_jax.conversion.hints import with_hints
from mocap_jax.conversion.mounted import mounted
from mocap_jax.conversion.mvn_body import mvn_body, truth_on
from mocap_jax.conversion.options import ConvertOptions
from mocap_jax.errors import InputError
from mocap_jax.initialise import check_readings, check_sensors, with_orientations
from mocap_jax.io.convert import (
    Mapping,
    Overrides,
    ReadOptions,
    Source,
    Worn,
    is_column_mapping,
    left_out,
    presets,
    read_column_mapping,
    read_mapping,
    read_source,
    recording_of,
    worn_sensors,
)
from mocap_jax.motion import JOINT_SUFFIXES, load_skeleton
from mocap_jax.recording import Recording, ragged_ends

MVN_BODY = "mvn"
"""Name of the body that an MVNX file itself describes."""
_OVERRIDES = tuple(f.name for f in dataclasses.fields(Overrides))


@dataclasses.dataclass(frozen=True)
class Converted:
    """A converted recording, and what is to be said of it."""

    recording: Recording
    findings: tuple[str, ...]
    """What seems wrong with it, one sentence each."""
    remarks: tuple[str, ...]
    """What was left out or could not be checked."""


def convert(
    sources: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    format: str | None = None,
    mapping: str | os.PathLike[str] | None = None,
    body: Body | str | os.PathLike[str] | None = None,
    options: ConvertOptions = ConvertOptions(),  # noqa: B008  (frozen)
) -> Recording:
    """Convert a recording of another system.

    Findings of the checks (wrong units, quaternion order, exchanged sensors, ...) and what was left
    out are given as warnings; what was lost stands in the recording's `salvage`.

    Args:
        sources: a file or folder, or several files that belong together.
        format: `xsens-mt`, `mvnx`, `x-io`, `apdm`, `apdm-csv`, `mat`, `totalcapture`, `dip-imu` or
            `csv`; None finds out.
        mapping: which sensor is worn where (OpenSense XML, TOML, CSV), or what the columns of a
            plain file are (TOML), or the name of a preset (`qmt_full_body`, `broad`).
        body: carries the sensors, on sites that the mapping places: a body, an MJCF file, an
            OpenSim model, a skeleton of joint positions (see `load_skeleton`), or `mvn` for the
            character of an MVNX file. None leaves the recording without a body.
        options: units, conventions and what else the files do not say.

    Raises:
        InputError: a missing, wrong or unknown file, column, sensor or choice; with
            `options.strict`, the first finding.
    """
    result = converted(sources, format=format, mapping=mapping, body=body, options=options)
    for text in (*result.findings, *result.remarks):
        warnings.warn(text, UserWarning, stacklevel=2)
    return result.recording


def converted(
    sources: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    format: str | None = None,
    mapping: str | os.PathLike[str] | None = None,
    body: Body | str | os.PathLike[str] | None = None,
    options: ConvertOptions = ConvertOptions(),  # noqa: B008  (frozen)
    progress: bool = False,
) -> Converted:
    """`convert`, with findings and remarks as values instead of warnings."""
    given = None if mapping is None else os.fspath(mapping)
    columns = given is not None and (given in presets() or is_column_mapping(Path(given)))
    table = None if columns or given is None else read_mapping(Path(given))
    read = ReadOptions(
        options.rate_hz, given if columns else None,
        options.trial or (table.trial if table else None), progress,
    )  # fmt: skip
    if columns and format is None:
        format = _format_of(str(given))
    source = read_source(sources, format, read)
    worn = worn_sensors(source, table or _columns_mapping(source, given if columns else None))
    overrides = Overrides(**{k: getattr(options, k, None) for k in _OVERRIDES})
    recording = recording_of(source, worn, overrides)
    remarks = (*source.remarks, *left_out(source, worn))
    if options.orientation is not None:
        measured = recording
        recording = with_orientations(
            recording, magnetometer=options.orientation == "vqf-magnetometer"
        )
        if recording is measured:
            remarks += ("All sensors measure orientation: none was estimated.",)
    recording, told = _on_body(recording, source, worn, body)
    findings, unchecked = _checks(recording, worn)
    convention = source.convention.with_overrides(overrides, source.name)
    findings = with_hints(findings, convention)
    if options.strict and findings:
        more = f" ({len(findings) - 1} more findings)" if len(findings) > 1 else ""
        raise InputError(f"{source.name}: {findings[0]}{more}")
    ends = ragged_ends(recording)
    return Converted(recording, findings, (*remarks, *ends, *told, *unchecked))


def _format_of(mapping: str) -> str:
    for name in ("csv", "mat"):
        try:
            return read_column_mapping(mapping, name, "the source").format
        except InputError as error:
            wrong = error
            if "is a mapping of" not in str(error):
                raise
    raise wrong


def _columns_mapping(source: Source, given: str | None) -> Mapping | None:
    """The mapping that a mapping of columns is at the same time, preset or not."""
    name = given or Path(str(source.facts.get("mapping", ""))).stem
    if source.format not in ("csv", "mat") or not name:
        return None
    return read_column_mapping(name, source.format, source.name).mapping


def _on_body(
    recording: Recording,
    source: Source,
    worn: dict[str, Worn],
    body: Body | str | os.PathLike[str] | None,
) -> tuple[Recording, tuple[str, ...]]:
    """With its body and truth, where they can be had, and what is to be said of them."""
    poses = source.poses
    if body is None:
        text = "Segment poses of the file are left out: there is no body to carry them."
        return recording, (text,) if poses is not None else ()
    if isinstance(body, str) and body == MVN_BODY:
        carrier = mvn_body(poses, source.name)
    else:
        carrier = body if isinstance(body, Body) else _read_body(body)
    recording = mounted(recording, carrier, worn.values())
    told: tuple[str, ...] = ()
    if "mounting" in recording.setup.provenance:
        told = (
            "Mounting is nominal where the mapping has no position and orientation: sensors are "
            "yet to be aligned with their segments (mocap-jax calibrate mounting).",
        )
    if poses is None or recording.body_xml is None:
        return recording, told
    start = min(float(s.time[0]) for s in source.sensors if s.identity in worn)
    truth = truth_on(load_body(recording.body_xml), poses, start)
    if truth is None:
        text = (
            "Segment poses of the file are left out: this body cannot carry them (it needs a free "
            f"root and a ball joint for each of MVN's segments; body '{MVN_BODY}' does)."
        )
        return recording, (*told, text)
    return dataclasses.replace(recording, truth=truth), told


def _read_body(file: str | os.PathLike[str]) -> Body:
    """An MJCF body, an OpenSim model or a skeleton of joint positions, by suffix."""
    if Path(file).suffix.lower() in JOINT_SUFFIXES:
        return load_skeleton(file)
    return load_body(file, free_root=True)


def _checks(recording: Recording, worn: dict[str, Worn]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Findings and what could not be checked; with a body only where mounting is known."""
    check = check_readings(recording)
    findings, remarks = list(check.sentences), list(check.remarks)
    known = all(w.orientation is not None for w in worn.values())
    if recording.body_xml is not None and known and not findings:
        placed = check_sensors(recording)
        findings += [s for s in placed.sentences if s not in findings]
    return tuple(findings), tuple(remarks)

"""`mocap-jax calibrate offsets`: constant excess of ultrasonic sources' distances."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

import numpy as np

from mocap_jax.cli.calibrate_kind import (
    Kinds,
    about,
    add_kind,
    add_outputs,
    check_outputs,
    read_recordings,
    write_figures,
)
from mocap_jax.cli.files import exit_code

if TYPE_CHECKING:
    from mocap_jax.calibration import SourceOffsets

NOTE = """How to record: fix sources and receivers at several distances (Vlasic 2007: 30 to 90 cm),
measure these by other means, and record some seconds of each. TABLE is a CSV file with a heading
and one line for each distance:
  source, true_m                  needed: the source's site, the distance in metres
  measured_m                      the distance as it was read; or, from recordings,
  receiver                        the sensor that heard it
  recording                       file name of the recording, where there are several
  start_s, end_s                  interval to use (default: all of the recording)
Lines of the same source and distance with several readings may be repeated; a blank measured_m is
a reading that is missing. The prefix of a source's site (source/, anchor/) may be left out.

Method: a distance's excess is the median of its readings less the true distance; a source's offset
is the mean excess of its distances. The left-out error is that of each distance when the others of
its source calibrate it. A distance far from what the others of its source say (5 deviations) has
failed and counts for nothing but its own error. Scatter about the median, RMS over distances with
ten readings or more, is written to [noise] as range."""
_ENOUGH = 10
"""Readings of a distance from which their scatter says something."""


def add_parser(kinds: Kinds) -> None:
    """The parser of this kind."""
    parser = add_kind(
        kinds, "offsets", summary="offsets of ultrasonic sources from known distances",
        example="mocap-jax calibrate offsets distances.csv near.mcap far.mcap -o setup.toml",
        note=NOTE, run=run,
    )  # fmt: skip
    parser.add_argument("table", metavar="TABLE", help="known distances (.csv)")
    parser.add_argument("recordings", metavar="REC", nargs="*", help="recordings (.mcap)")
    add_outputs(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the kind."""
    check_outputs(arguments)
    from mocap_jax.calibration import calibrate_source_offsets
    from mocap_jax.cli.distance_table import known_distances
    from mocap_jax.io import SetupFigures

    recordings = read_recordings(arguments.recordings)
    named = dict(zip(arguments.recordings, recordings, strict=True))
    distances = known_distances(arguments.table, named)
    with about([arguments.table]):
        found = calibrate_source_offsets(distances)
    print("\n".join(_table(found)))
    scatter = _scatter(found)
    noise = {} if scatter is None else {"range": scatter}
    write_figures(arguments, SetupFigures(found.calibration, noise), _json(found))
    return exit_code(*recordings)


def _scatter(found: SourceOffsets) -> float | None:
    """RMS scatter of readings [m]; None where there are too few, or it is 0."""
    known = [
        s for s, d in zip(found.scatter, found.distances, strict=True) if d.measured.size >= _ENOUGH
    ]
    value = float(np.sqrt(np.mean(np.square(known)))) if known else 0.0
    return value or None


def _table(found: SourceOffsets) -> list[str]:
    width = max(6, *(len(name) for name in found.offsets))
    lines = [
        f"{'source':{width}s} {'distances':>9s}  {'offset [mm]':>18s}  {'raw error':>18s}  "
        f"{'left-out error':>18s}",
        f"{'':{width}s} {'':9s}  {'':18s}  {'mean, sd |.| [mm]':>18s}  {'mean, sd |.| [mm]':>18s}",
    ]
    names = np.array([d.source for d in found.distances])
    for name, o in found.offsets.items():
        own = names == name
        sigma = f"+- {1e3 * o.sigma:7.3f}" if o.sigma else "(one only)"
        lines.append(
            f"{name:{width}s} {own.sum():9d}  {1e3 * o.offset:8.3f} {sigma}  "
            f"{_errors(found.raw_error[own])}  {_errors(found.left_out_error[own])}"
        )
    lines.append(
        f"{'all':{width}s} {len(names):9d}  {'':18s}  {_errors(found.raw_error)}  "
        f"{_errors(found.left_out_error)}"
    )
    for d, error, failed in zip(found.distances, found.raw_error, found.failed, strict=True):
        if failed:
            lines.append(
                f"left out: {d.source} at {d.true:g} m, {1e3 * error:+.1f} mm, far from what its "
                "other distances say"
            )
    scatter = _scatter(found)
    if scatter is not None:
        lines.append(f"scatter of readings: [noise] range = {1e3 * scatter:.3f} mm")
    return lines


def _errors(errors: np.ndarray) -> str:
    known = np.abs(errors[np.isfinite(errors)])
    return f"{1e3 * known.mean():9.3f}{1e3 * known.std():9.3f}" if known.size else f"{'-':>18s}"


def _json(found: SourceOffsets) -> dict[str, Any]:
    sources = {n: {"offset_m": o.offset, "sigma_m": o.sigma} for n, o in found.offsets.items()}
    left = [None if e != e else float(e) for e in found.left_out_error]
    return {
        "kind": "offsets",
        "sources": sources,
        "distances": [
            {"source": d.source, "receiver": d.receiver, "true_m": d.true,
             "readings": int(np.isfinite(d.measured).sum()), "raw_error_m": float(raw),
             "left_out_error_m": out, "failed": bool(bad)}
            for d, raw, out, bad in zip(
                found.distances, found.raw_error, left, found.failed, strict=True
            )
        ],
    }  # fmt: skip

"""OpenSense's example walk: files of the Xsens export, mapping and set-up, as a `Recording`."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import numpy as np

RATE_HZ = 100.0


def folder() -> Path | None:
    """Where the example is; None where it is not."""
    root = Path(__file__).resolve().parents[2]
    shared = Path(os.environ.get("MOCAP_JAX_DATA", root.parent / "shared" / "data"))
    found = shared / "opensense_walking"
    return found if found.is_dir() else None


def cut(recording, start: float, end: float):
    """The recording between two times, both included."""
    streams = {}
    for name, stream in recording.inertial.items():
        inside = (stream.time >= start - 1e-9) & (stream.time <= end + 1e-9)
        streams[name] = dataclasses.replace(
            stream,
            **{f.name: getattr(stream, f.name)[inside] for f in dataclasses.fields(stream)},
        )
    return dataclasses.replace(recording, inertial=streams)


def read_walk(folder: Path):
    """The recording: orientations and accelerations, as long as all sensors have them."""
    from mocap_jax.conversion import converted

    recording = converted(folder / "IMUData", mapping=folder / "myIMUMappings.xml").recording
    end = min(float(stream.time[-1]) for stream in recording.inertial.values())
    return cut(recording, 0.0, end)


def write_orientations(path: Path, recording) -> None:
    """The measured orientations as OpenSim's table of quaternions (STO)."""
    names = list(recording.inertial)
    head = [f"DataRate={RATE_HZ:.6f}", "DataType=Quaternion", "version=3", "OpenSimVersion=4.0",
            "endheader"]  # fmt: skip
    lines = [*head, "\t".join(["time", *names])]
    time = np.asarray(recording.inertial[names[0]].time)
    for k, t in enumerate(time):
        quats = [recording.inertial[n].orientation[k].tolist() for n in names]
        cells = [",".join(map(repr, quat)) for quat in quats]
        lines.append("\t".join([repr(float(t)), *cells]))
    path.write_text("\n".join(lines) + "\n")

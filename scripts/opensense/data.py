"""OpenSense's example walk: files of the Xsens export, mapping and set-up, as a `Recording`."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

PREFIX = "MT_012005D6_009-001"
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


def mapping(folder: Path) -> dict[str, str]:
    """File suffix (serial number) to name in the model, `<body>_imu`."""
    tree = ElementTree.parse(folder / "myIMUMappings.xml")
    return {
        e.get("name", ""): (e.findtext("name_in_model") or "").strip()
        for e in tree.iter("ExperimentalSensor")
    }


def read_walk(folder: Path):
    """The recording: orientations and accelerations, on the packets that all sensors have."""
    from mocap_jax.recording import InertialStream, Recording, SensorSpec, Setup

    tables = {name: _table(folder, serial) for serial, name in mapping(folder).items()}
    packets = sorted(set.intersection(*(set(t.index) for t in tables.values())))
    time = (np.array(packets) - packets[0]) / RATE_HZ
    inertial = {}
    for name, table in tables.items():
        rows = table.loc[packets]
        # The export has columns of the matrix one after the other.
        R = rows[[f"Mat[{i}][{j}]" for i in (1, 2, 3) for j in (1, 2, 3)]].to_numpy()
        inertial[name] = InertialStream(
            time,
            rows[["Acc_X", "Acc_Y", "Acc_Z"]].to_numpy(),
            np.full((len(packets), 3), np.nan),
            Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat(scalar_first=True),
        )
    setup = Setup(sensors=tuple(SensorSpec(n, n, RATE_HZ) for n in inertial))
    return Recording(inertial, None, None, {}, None, None, setup, None, subject="OpenSense")


def _table(folder: Path, serial: str) -> pd.DataFrame:
    path = folder / "IMUData" / f"{PREFIX}{serial}.txt"
    table = pd.read_csv(path, sep="\t", comment="/", dtype={"PacketCounter": int})
    return table.set_index("PacketCounter")


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

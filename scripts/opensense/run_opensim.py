"""OpenSim's own inverse kinematics, in whichever Python has it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

SIDE = Path(__file__).with_name("opensim_side.py")
HOW = (
    "OpenSim is skipped: there is no `opensim` in this environment (pip install opensim; Python "
    "3.11), and MOCAP_JAX_OPENSIM_PYTHON names no Python that has it."
)


@dataclass(frozen=True)
class OpensimMotion:
    """What OpenSim found: degrees and metres."""

    time: np.ndarray
    columns: dict[str, np.ndarray]
    seconds: dict[str, float]
    """Wall-clock and processor time of the inverse kinematics alone."""


def opensim_python() -> str | None:
    """A Python that can import `opensim`; None without one."""
    named = os.environ.get("MOCAP_JAX_OPENSIM_PYTHON")
    if named:
        return named
    return sys.executable if find_spec("opensim") is not None else None


def run_ik(
    python: str, model: Path, orientations: Path, folder: Path, interval: tuple[float, float]
) -> OpensimMotion:
    """Place the sensors and solve; raises `RuntimeError` with OpenSim's last lines."""
    start, end = (repr(t) for t in interval)
    _run(python, folder, "ik", str(model), str(orientations), str(folder), start, end)
    seconds = json.loads((folder / "seconds.json").read_text())
    time, columns = read_motion(folder / "ik.mot")
    return OpensimMotion(time, columns, seconds)


def run_kinematics(python: str, model: Path, folder: Path) -> list[dict]:
    """Coordinates, and frames of all bodies, of random poses."""
    out = folder / "kinematics.json"
    _run(python, folder, "kinematics", str(model), str(out))
    return json.loads(out.read_text())


def _run(python: str, folder: Path, *arguments: str) -> None:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(
        [python, str(SIDE), *arguments], capture_output=True, text=True, check=False,
        cwd=folder, env=environment,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError("\n".join((done.stdout + done.stderr).splitlines()[-5:]))


def read_motion(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times and columns of a MOT file."""
    lines = path.read_text().splitlines()
    begin = lines.index("endheader") + 1
    names = lines[begin].split()
    table = np.array([[float(x) for x in line.split()] for line in lines[begin + 1 :]])
    return table[:, 0], {n: table[:, i] for i, n in enumerate(names) if i}

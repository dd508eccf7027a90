"""Peak memory of a long whole-sequence solve, in a process of its own."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import mocap_jax as mj
from benchmarks import recordings
from benchmarks.metric import Metric
from benchmarks.sequence_problem import true_poses

FRAMES = 20_000
_RATE_HZ = 140.0


def peak_memory() -> Metric:
    """Largest resident size while solving 20000 frames, covariances included.

    The solve starts from the true poses, perturbed: only memory is measured, so an estimate by
    the filter would just take time. Two rounds of two iterations reach every stage (assembly,
    factorisation, re-estimated noise, covariances). The truth is not in the solver's recording.
    """
    recording = recordings.of_duration(FRAMES / _RATE_HZ, clip="routine")
    truth = true_poses(recording)
    with tempfile.TemporaryDirectory() as folder:
        path, guess = Path(folder, "recording.mcap"), Path(folder, "guess.npz")
        mj.write_recording(path, dataclasses.replace(recording, truth=None))
        np.savez(guess, time=truth.trajectory.time, q=truth.trajectory.q)
        child = Path(__file__).with_name("memory_process.py")
        done = subprocess.run(
            [sys.executable, str(child), str(path), str(guess)],
            check=True, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
    found = json.loads(done.stdout.splitlines()[-1])
    peak = found.pop("peak_gb")
    return Metric(
        "peak_memory_gb_20000_frames", peak, "GB", "lower", 6.0,
        found | recordings.size(recording),
    )  # fmt: skip

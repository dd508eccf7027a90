"""Solve a recording from a given guess and print the peak memory of this process as JSON.

python memory_process.py RECORDING.mcap GUESS.npz
"""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import mocap_jax as mj
from mocap_jax.body import load_body
from mocap_jax.cli.main import prepare_process
from mocap_jax.estimate.whole_sequence_options import NoiseOptions, OptimiseOptions
from mocap_jax.least_squares import SolverOptions
from mocap_jax.solution import Solution, Status
from mocap_jax.trajectory import Trajectory

_PERTURBATION = 0.01
"""Deviation added to joint coordinates [rad]."""


def main(recording_path: str, guess_path: str) -> None:
    """Solve and report."""
    prepare_process()
    recording = mj.read_recording(recording_path)
    body = load_body(recording.body_xml, free_root=True)
    guess = np.load(guess_path)
    q = np.array(guess["q"])
    q[:, 7:] += np.random.default_rng(0).normal(0, _PERTURBATION, q[:, 7:].shape)
    quats = body.topology.quat_index[0]
    q[:, quats] /= np.linalg.norm(q[:, quats], axis=-1, keepdims=True)
    trajectory = Trajectory(guess["time"], q)
    initial = Solution(trajectory, body, Status.FILTERED, "guess", recording.setup)
    options = OptimiseOptions(
        noise=NoiseOptions(rounds=2), solver=SolverOptions(max_iterations=2), covariance=True
    )
    start = time.perf_counter()
    solution = mj.optimise(recording, body, initial=initial, options=options)
    seconds = time.perf_counter() - start
    if solution.covariance is None:
        sys.exit("the solve made no covariance: its memory does not count")
    frames = len(solution.trajectory.time)
    # Linux reports kibibytes.
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
    print(json.dumps({"peak_gb": peak, "frames": frames, "dof": body.nv, "solve_s": seconds}))


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Innovation likelihoods of process noise, on a trial that is used for nothing else."""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.arm import WristFilterOptions, paper_tracker
from mocap_jax.arm.track import JERK_DENSITY, filter_options
from mocap_jax.body import load_body
from mocap_jax.estimate.filter_chunk import filter_chunk
from mocap_jax.estimate.filter_run import prepare
from mocap_jax.initialise import rest_pose
from mocap_jax.kalman import SigmaPoints
from mocap_jax.recording import Recording
from mocap_jax.simulation.arm import ArmScene, simulate_arm
from mocap_jax.simulation.arm_movement import ArmMovement

SEED = 1000
STEPS = (0.005, 0.007, 0.01, 0.014, 0.02)
DENSITIES = (10.0, 30.0, 100.0, 300.0, 1000.0, 10000.0)


def report(seconds: float) -> None:
    """Print the log-likelihood of every candidate."""
    recording = simulate_arm(ArmScene(movement=ArmMovement(seconds=seconds)), SEED)
    print(f"paper's filter, by step_sigma [m] (in use: {WristFilterOptions().step_sigma:g})")
    for step in STEPS:
        found = paper_tracker(recording, WristFilterOptions(step_sigma=step))
        print(f"  {step:<8g} {found.log_likelihood:10.1f}")
    print(f"joint UKF, by jerk density [rad^2/s^5] (in use: {JERK_DENSITY:g})")
    for density in DENSITIES:
        print(f"  {density:<8g} {log_likelihood(recording, density):10.1f}", flush=True)


def log_likelihood(recording: Recording, density: float) -> float:
    """Of the ranges' innovations in the joint-angle filter."""
    options = filter_options(1 / recording.setup.pulse_interval)
    options = dataclasses.replace(options, joint_jerk_density=density)
    body = load_body(recording.body_xml)
    rest = rest_pose(recording, body, options=options.rest)
    run = prepare(recording, body, options, rest, True, SigmaPoints())
    state, total = run.start, 0.0
    for frames in run.chunks:
        state, _, seen = filter_chunk(run.body, run.model, run.parameters, state, frames)
        told = np.asarray(seen["D"].log_likelihood)
        total += float(told[np.asarray(frames.valid, bool)].sum())
    return total

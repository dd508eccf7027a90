"""What process noise is chosen by, on a trial that is used for nothing else."""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.arm import ArmTrack, WristFilterOptions, paper_tracker
from mocap_jax.arm.errors import ROWS
from mocap_jax.arm.track import JERK_DENSITY, filter_options, loosened, tracked
from mocap_jax.body import load_body
from mocap_jax.estimate import EkfOptions, ukf
from mocap_jax.estimate.filter_chunk import filter_chunk
from mocap_jax.estimate.filter_run import prepare
from mocap_jax.initialise import rest_pose
from mocap_jax.kalman import SigmaPoints
from mocap_jax.recording import Recording
from mocap_jax.simulation.arm import ArmScene, declared, simulate_arm
from mocap_jax.simulation.arm_movement import ArmMovement

SEED = 1000
STEPS = (0.005, 0.007, 0.01, 0.014, 0.02)
DENSITIES = (30.0, 100.0, 300.0, 1000.0)


def report(seconds: float) -> None:
    """Print likelihood and errors of every candidate.

    Innovations of the joint UKF are no white noise where the mobile vibrates, so that their
    likelihood misleads: its process noise goes by the errors.
    """
    scene = ArmScene(movement=ArmMovement(seconds=seconds))
    recording = simulate_arm(scene, SEED)
    print("log-likelihood, and standard deviations: " + ", ".join(ROWS))
    print(f"paper's filter, by step_sigma [m] (in use: {WristFilterOptions().step_sigma:g})")
    for step in STEPS:
        found = paper_tracker(recording, WristFilterOptions(step_sigma=step))
        print(f"  {step:<8g} {found.log_likelihood:10.1f}  {_stds(found, recording)}")
    print(f"joint UKF, by jerk density [rad^2/s^5] (in use: {JERK_DENSITY:g})")
    sagittal = loosened(declared(recording, scene, "sagittal"))
    for density in DENSITIES:
        options = dataclasses.replace(filter_options(scene.rate_hz), joint_jerk_density=density)
        found = tracked(ukf(sagittal, options=options))
        told = log_likelihood(sagittal, options)
        print(f"  {density:<8g} {told:10.1f}  {_stds(found, recording)}", flush=True)


def _stds(found: ArmTrack, recording: Recording) -> str:
    return " ".join(f"{x:.2f}" for x in found.errors(recording).std)


def log_likelihood(recording: Recording, options: EkfOptions) -> float:
    """Of the ranges' innovations in the joint-angle filter."""
    body = load_body(recording.body_xml)
    rest = rest_pose(recording, body, options=options.rest)
    run = prepare(recording, body, options, rest, True, SigmaPoints())
    state, total = run.start, 0.0
    for frames in run.chunks:
        state, _, seen = filter_chunk(run.body, run.model, run.parameters, state, frames)
        told = np.asarray(seen["D"].log_likelihood)
        total += float(told[np.asarray(frames.valid, bool)].sum())
    return total

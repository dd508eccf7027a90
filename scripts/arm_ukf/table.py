"""Table II beside ours, and the bars it is held against."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from arm_ukf.pictures import trial_figure
from arm_ukf.trackers import (
    JOINTS,
    OPTIMISER,
    PAPER,
    PLANAR,
    ROBUST,
    TABLE_II,
    TRACKERS,
    as_json,
    pooled,
    print_table,
    track,
    verdicts,
)
from mocap_jax.arm import ArmErrors, ArmTrack, joint_filter, optimised
from mocap_jax.arm.errors import ROWS
from mocap_jax.simulation.arm import ArmScene, declared, simulate_arm
from mocap_jax.simulation.arm_movement import ArmMovement

OUTLIERS = "robust, 20 % out"
_BENT = np.deg2rad(30.0)
_SHARE = 0.2


def report(trials: int, seconds: float, first: int, figures: Path | None) -> dict[str, Any]:
    """Run the trials, from that of seed `first` on, and print the tables."""
    scene = ArmScene(movement=ArmMovement(seconds=seconds))
    describe(scene, trials)
    whole: dict[str, list[ArmErrors]] = {}
    bent: dict[str, list[ArmErrors]] = {}
    clamped = []
    for seed in range(first, first + trials):
        recording = simulate_arm(scene, seed)
        tracks = track(recording, scene)
        dirty = simulate_arm(dataclasses.replace(scene, outliers=_SHARE), seed)
        tracks[OUTLIERS] = track(dirty, scene, (ROBUST,))[ROBUST]
        for name, found in tracks.items():
            whole.setdefault(name, []).append(found.errors(recording))
            bent.setdefault(name, []).append(found.errors(recording, _BENT))
        clamped.append(float(tracks[PAPER].clamped.mean()))
        print(f"trial {seed - first + 1}: " + _short(tracks, whole), flush=True)
        if seed == first and figures is not None:
            trial_figure(recording, tracks, figures / "arm_tracker_trial.png")
    columns = {name: pooled(each) for name, each in whole.items()}
    print("\nOver all pulses:")
    print_table({"Table II": TABLE_II, **columns})
    print(f"\nOut of reach, elbow clamped: {100 * np.mean(clamped):.1f} % of the pulses.")
    print("\nWhere the elbow is bent by more than 30 degrees:")
    above = {name: pooled(each) for name, each in bent.items()}
    print_table(above)
    bars(columns)
    spatial = in_space(scene, first)
    return {
        "all": as_json(columns), "bent": as_json(above), "spatial": as_json(spatial),
        "clamped": float(np.mean(clamped)),
    }  # fmt: skip


def describe(scene: ArmScene, trials: int) -> None:
    """What the paper leaves open."""
    m = scene.movement
    print(f"{trials} trials of {m.seconds:g} s; {scene.rate_hz:g} pulses a second; range noise "
          f"{1000 * scene.noise:g} mm; upper arm {scene.upper_arm:g} m, forearm {scene.forearm:g} m"
          f"; shoulder at {scene.shoulder} m")  # fmt: skip
    places = "; ".join(
        f"{n} ({', '.join(f'{x:.2f}' for x in p)})" for n, p in scene.anchors.items()
    )
    print(f"anchors (x forward, y to the left, z up) [m]: {places}")
    print(f"elbow {m.elbow_deg} deg in {m.period:g} s, shoulder {m.shoulder_deg} deg, out of plane "
          f"{m.out_of_plane_deg:g} deg RMS, vibration {1000 * m.vibration:g} mm RMS")  # fmt: skip


def bars(columns: dict[str, ArmErrors]) -> None:
    """What is asked for, and whether it is met."""
    ukf = {n: columns[n] for n in (PAPER, PLANAR, JOINTS)}
    paper = lambda e: (np.abs(e.mean) <= np.abs(TABLE_II.mean)) & (e.std <= TABLE_II.std)  # noqa: E731
    print(f"\nAt or below table II: {verdicts(ukf, paper)}")
    for name in (OPTIMISER, ROBUST):
        for against in (PAPER, JOINTS):
            ratio = columns[name].std / columns[against].std
            print(f"{name} over {against} (at most 0.7): " + _ratios(ratio))
    ratio = columns[OUTLIERS].std / columns[ROBUST].std
    print("robust optimiser, with outliers over without (below 1.5): " + _ratios(ratio))


def in_space(scene: ArmScene, seed: int) -> dict[str, ArmErrors]:
    """The arm with a ball joint at the shoulder, on the first trial."""
    recording = declared(simulate_arm(scene, seed), scene, "ball")
    start = joint_filter(recording, smooth=True)
    tracks = {JOINTS: joint_filter(recording), OPTIMISER: optimised(recording, initial=start)}
    print("\nFirst trial, shoulder as a ball joint (the shoulder's row follows the swivel, which "
          "is not determined):")  # fmt: skip
    columns = {name: found.errors(recording) for name, found in tracks.items()}
    print_table(columns)
    for name, found in tracks.items():
        print(f"{name}: {found.remarks[-1]}")
    return columns


def _ratios(values: np.ndarray) -> str:
    return ", ".join(f"{row.split(' ')[0]} {v:.2f}" for row, v in zip(ROWS, values, strict=True))


def _short(tracks: dict[str, ArmTrack], errors: dict[str, list[ArmErrors]]) -> str:
    """Standard deviations of one trial."""
    order = (*TRACKERS, OUTLIERS)
    return "; ".join(
        f"{n} " + " ".join(f"{x:.2f}" for x in errors[n][-1].std) for n in order if n in tracks
    )

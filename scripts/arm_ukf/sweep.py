"""What the errors depend on: anchor geometry, thermometers, and what the arm does besides."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from arm_ukf.pictures import sweep_figure
from arm_ukf.trackers import JOINTS, OPTIMISER, PAPER, as_json, track
from mocap_jax.arm import ArmErrors
from mocap_jax.arm.errors import ROWS
from mocap_jax.simulation.arm import ArmScene, anchor_frame, simulate_arm
from mocap_jax.simulation.arm_movement import ArmMovement

_COMPARED = (PAPER, JOINTS, OPTIMISER)


def scenes(seconds: float) -> dict[str, dict[str, ArmScene]]:
    """Scenes by what they vary."""
    movement = ArmMovement(seconds=seconds)
    scene = ArmScene(movement=movement)
    placed = lambda *size, **where: dataclasses.replace(  # noqa: E731
        scene, anchors=anchor_frame(*size, **where)
    )
    moved = lambda **changes: dataclasses.replace(  # noqa: E731
        scene, movement=dataclasses.replace(movement, **changes)
    )
    return {
        "anchor geometry": {
            "2.0 x 1.5 m, 0.3 m aside": scene,
            "2.0 x 1.5 m, 0.6 m aside": placed(aside=0.6),
            "2.0 x 1.5 m, 1.0 m aside": placed(aside=1.0),
            "1.0 x 0.75 m": placed(1.0, 0.75),
            "0.5 x 0.4 m": placed(0.5, 0.4),
            "all in front": placed(1.0, 1.5, centre=(1.1, 1.1)),
            "all above": placed(2.0, 0.5, centre=(0.3, 1.9)),
        },
        "thermometers": {
            f"{k:g} K": dataclasses.replace(scene, thermometer=k) for k in (0.5, 1.0, 2.0)
        },
        "survey of anchors": {
            f"{1000 * s:g} mm": dataclasses.replace(scene, survey=s) for s in (0.002, 0.005, 0.01)
        },
        "movement": {
            "in the plane": moved(out_of_plane_deg=0.0),
            "no vibration": moved(vibration=0.0),
            "neither": moved(out_of_plane_deg=0.0, vibration=0.0),
            **{f"elbow from {a:g} deg": moved(elbow_deg=(a, 125.0)) for a in (20.0, 30.0, 40.0)},
        },
    }


def report(seconds: float, seed: int, figures: Path | None) -> dict[str, Any]:
    """Run and print all of them, one trial each."""
    out: dict[str, Any] = {}
    geometry: dict[str, dict[str, ArmErrors]] = {}
    print("standard deviations (bias in brackets where above a third of it): "
          + ", ".join(ROWS))  # fmt: skip
    for group, members in scenes(seconds).items():
        print(f"\n{group}:")
        for name, scene in members.items():
            recording = simulate_arm(scene, seed)
            columns = {
                n: t.errors(recording) for n, t in track(recording, scene, _COMPARED).items()
            }
            out[f"{group}/{name}"] = as_json(columns)
            if group == "anchor geometry":
                geometry[name] = columns
            cells = "   ".join(f"{n} {_row(e)}" for n, e in columns.items())
            print(f"  {name:26s} {cells}", flush=True)
    if figures is not None:
        sweep_figure(geometry, figures / "arm_tracker_geometry.png")
    return out


def _row(e: ArmErrors) -> str:
    return " ".join(
        f"{s:.2f}" + (f"({m:+.2f})" if abs(m) > s / 3 else "")
        for m, s in zip(e.mean, e.std, strict=True)
    )

"""MVNX documents of a known motion."""

from __future__ import annotations

import numpy as np
from known_motion import known

LABELS = ("Pelvis", "T8", "RightUpperLeg")
SEGMENTS = ("Pelvis", "L5", "L3", "T12", "T8", "RightUpperLeg")
RATE = 60.0


def numbers(values: np.ndarray) -> str:
    return " ".join(f"{x:.9f}" for x in np.ravel(values))


def document(n: int = 120, *, version: int = 4, aligned: bool = True, sensors: bool = True) -> str:
    motions = {label: known(n, RATE, seed) for seed, label in enumerate(LABELS)}
    offsets = np.arange(3 * len(SEGMENTS)).reshape(-1, 3) / 10
    one = np.tile([1.0, 0, 0, 0], (len(SEGMENTS), 1))
    frames = []
    if aligned:
        frames.append(
            f'<frame time="0" type="identity"><orientation>{numbers(one)}</orientation>'
            f"<position>{numbers(offsets)}</position></frame>"
        )
    for k in range(n):
        parts = []
        stack = lambda what: np.stack([getattr(m, what)[k] for m in motions.values()])  # noqa: B023, E731
        if sensors:
            parts.append(("sensorOrientation", stack("orientation")))
            parts.append(("sensorMagneticField", stack("field") / 5e-5))
        if sensors and version == 4:
            parts.append(("sensorFreeAcceleration", stack("free_world")))
        elif sensors:
            parts.append(("sensorAcceleration", stack("force")))
            parts.append(("sensorAngularVelocity", stack("rate")))
        turned = np.zeros((len(SEGMENTS), 3))
        for label, motion in motions.items():
            turned[SEGMENTS.index(label)] = motion.matrices[k] @ motion.rate[k]
        parts += [("orientation", one), ("position", offsets + k), ("angularVelocity", turned)]
        body = "".join(f"<{tag}>{numbers(v)}</{tag}>" for tag, v in parts)
        frames.append(f'<frame time="{round(k / RATE * 1000)}" index="{k}" type="normal">{body}'
                      "</frame>")  # fmt: skip
    return (
        f'<?xml version="1.0"?><mvnx version="{version}" xmlns="http://www.xsens.com/mvn/mvnx">'
        f'<subject label="P01" frameRate="{RATE:g}" recDateMSecsSinceEpoch="1700000000123">'
        "<segments>" + "".join(f'<segment label="{s}"/>' for s in SEGMENTS) + "</segments>"
        "<sensors>" + "".join(f'<sensor label="{s}"/>' for s in LABELS) + "</sensors>"
        "<frames>" + "".join(frames) + "</frames></subject></mvnx>"
    )

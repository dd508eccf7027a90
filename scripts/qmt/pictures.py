"""Strips of poses, a row a stretch of the recording."""

from __future__ import annotations

import dataclasses
import io

import numpy as np

STRETCHES = (
    ("stands, walks, sits down", 4.6, 13.0),
    ("gets up and walks", 39.0, 44.5),
    ("stands", 47.5, 53.0),
    ("starts to walk", 54.8, 58.0),
    ("walks briskly", 61.0, 62.2),
    ("turns", 98.2, 99.9),
)


def strips(path: str, solution, poses: int = 14) -> None:
    """One picture with the stretches below each other."""
    from PIL import Image

    from mocap_jax.report.strip import motion_strip

    time = np.asarray(solution.trajectory.time)
    pictures = []
    for _, start, end in STRETCHES:
        inside = (time >= start) & (time <= end)
        if inside.sum() < poses:
            continue
        q = np.asarray(solution.trajectory.q)[inside]
        part = dataclasses.replace(solution.trajectory, time=time[inside], q=q, v=None)
        figure = motion_strip(
            dataclasses.replace(solution, trajectory=part, covariance=None), poses=poses, width=13
        )
        buffer = io.BytesIO()
        figure.savefig(buffer, dpi=80)
        pictures.append(Image.open(buffer).convert("RGB"))
    if not pictures:
        return
    size = max(p.width for p in pictures), sum(p.height for p in pictures)
    sheet, top = Image.new("RGB", size, "white"), 0
    for picture in pictures:
        sheet.paste(picture, (0, top))
        top += picture.height
    sheet.save(path)

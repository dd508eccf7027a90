"""A human with the lengths of another skeleton."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.motion import body_from_asf, human, human_like, segment_lengths
from mocap_jax.motion.segment_match import rest_pose


def test_like_a_human_is_that_human() -> None:
    lengths = {"UpperArm": 0.30, "UpperLeg": 0.44, "LowerLeg": 0.40, "Shoulder": 0.2}
    model = human(0.84 / 0.491, 62.0, "female", lengths)
    found = segment_lengths(human_like(model, 62.0, "female"))
    assert found == pytest.approx(segment_lengths(model), rel=1e-6)


def test_like_a_clip_s_skeleton(shared_data: Path) -> None:
    clip = body_from_asf(shared_data / "cmu_mocap" / "02.asf")
    body = human_like(clip)
    there, here = rest_pose(clip, "clip"), rest_pose(body, "human")
    length = lambda r, a, b: np.linalg.norm(r.position[b] - r.position[a])  # noqa: E731
    for a, b in (("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot"), ("UpperArm", "ForeArm")):
        mean = np.mean([length(there, side + a, side + b) for side in ("Left", "Right")])
        assert length(here, f"Left{a}", f"Left{b}") == pytest.approx(mean, rel=1e-6)
    across = length(there, "LeftUpperArm", "RightUpperArm")
    assert length(here, "LeftUpperArm", "RightUpperArm") == pytest.approx(across, rel=1e-6)
    hips = lambda r: (r.position["LeftUpperLeg"] + r.position["RightUpperLeg"])[2] / 2  # noqa: E731
    head = there.position["Head"][2] - hips(there)
    assert here.position["Head"][2] - hips(here) == pytest.approx(head, rel=2e-3)
    mass = body.mujoco_model().body_mass.sum()
    stature = 2 * sum(length(here, *p) for p in (("LeftUpperLeg", "LeftLowerLeg"),
                                                 ("LeftLowerLeg", "LeftFoot"))) / 0.982  # fmt: skip
    assert mass == pytest.approx(70.0 * (stature / 1.75) ** 2)


def test_a_body_without_legs_is_refused() -> None:
    from mocap_jax.body import load_body

    body = load_body(
        "<mujoco><worldbody><body name='Pelvis'><freejoint/><geom size='.1'/></body></worldbody>"
        "</mujoco>"
    )
    with pytest.raises(InputError, match="the body to be like has no segment LeftUpperLeg"):
        human_like(body)

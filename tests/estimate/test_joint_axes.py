"""A joint found from motion in the whole-sequence solve: its axes, and its centre as unknowns."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from joint_samples import Sample, sample
from scipy.spatial.transform import Rotation

import mocap_jax as mj
from mocap_jax.errors import InputError
from mocap_jax.estimate import check_residual

TIME = np.arange(50) / 50.0


@pytest.fixture(scope="module")
def samples() -> dict[str, Sample]:
    return {kind: sample(kind, seconds=8.0) for kind in ("hinge", "universal", "ball")}


def on_a_ball(given: Sample) -> tuple[mj.JointFinding, mj.Recording, mj.Body]:
    finding = mj.find_joint(given.recording, "thigh", "shank")
    recording = mj.joint_recording(given.recording, finding, kind="ball")
    return finding, recording, mj.load_body(recording.body_xml)


@pytest.mark.parametrize("kind", ["hinge", "universal"])
def test_true_poses_have_none_and_derivatives_are_exact(samples: dict, kind: str) -> None:
    finding, _, body = on_a_ball(samples[kind])
    residual, rows = mj.joint_axes(finding, body, TIME, sigma=0.01, correlation_time=0.1)
    row = {name: values[0] for name, values in rows.items()}
    for k in (0, 150, 400):
        quat = samples[kind].relative[k].as_quat(scalar_first=True)
        q = np.concatenate([np.asarray(body.qpos0)[:7], quat])[None]
        share = np.sqrt(0.02 / 0.1)
        # The axes found are true to a few tenths of a degree.
        assert np.abs(residual.function(body, q, row)).max() < 0.007 / 0.01 * share
        report = check_residual(residual, body, q, row)
        assert report.ok, str(report)
    away = Rotation.from_rotvec([0.3, -0.2, 0.4]) * samples[kind].relative[0]
    q = np.concatenate([np.asarray(body.qpos0)[:7], away.as_quat(scalar_first=True)])[None]
    assert np.abs(residual.function(body, q, row)).max() > 2 * share


def test_wrong_input(samples: dict) -> None:
    finding, _, body = on_a_ball(samples["ball"])
    with pytest.raises(InputError, match="a ball joint was found"):
        mj.joint_axes(finding, body, TIME)
    finding, _, body = on_a_ball(samples["hinge"])
    with pytest.raises(InputError, match="sigma and correlation_time must be above 0"):
        mj.joint_axes(finding, body, TIME, sigma=0.0)
    stranger = dataclasses.replace(finding, sensors=("thigh", "foot"))
    with pytest.raises(InputError, match="site of a sensor 'foot'.*shank"):
        mj.joint_axes(stranger, body, TIME)


def test_lever_arms_as_unknowns_of_the_whole_sequence(samples: dict) -> None:
    """From arms that are off by 10 cm, within 3 mm of the truth."""
    given = samples["ball"]
    finding = mj.find_joint(given.recording, "thigh", "shank")
    wrong = np.array([[0.06, -0.06, 0.05], [-0.05, -0.06, 0.06]])
    guess = dataclasses.replace(
        finding, first_arm=given.arms[0] + wrong[0], second_arm=given.arms[1] + wrong[1]
    )
    recording = mj.joint_recording(given.recording, guess)
    options = mj.OptimiseOptions(
        kinds="AG", root="free", covariance=False,
        constants=mj.ConstantsOptions(mounting_sigma=0.0, offset_sigma=0.1, adapt=False),
        noise=mj.NoiseOptions(model_errors=False, adapt=False),
        prior=mj.PriorOptions(pose_sigma=10.0, limits=False),
    )  # fmt: skip
    solution = mj.optimise(recording, options=options)
    assert solution.status.ok
    for i, name in enumerate(("thigh", "shank")):
        off = wrong[i] - solution.calibration[f"mounting_offset/{name}"]
        assert np.linalg.norm(off) < 0.003

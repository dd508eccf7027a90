"""A joint is found from the motion of two sensors: centre, kind, axes, and what stays unknown."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from joint_samples import Sample, sample
from scipy.spatial.transform import Rotation

import mocap_jax as mj
from mocap_jax.body import site_frames
from mocap_jax.errors import InputError
from mocap_jax.initialise.joint.axes import _off_plane, _off_plane_by_axes
from mocap_jax.recording import InertialStream
from mocap_jax.simulation.profiles import profile_named

SENSORS = ("thigh", "shank")
KINDS = ("hinge", "universal", "ball")
# All that goes wrong in sensors, with mountings and body as they are said to be.
ROUGH = dataclasses.replace(
    profile_named("field"), mounting_rotation=0.0, mounting_slide=0.0, mounting_depth=0.0,
    rest_pose=0.0, tissue_frequency=0.0, tissue_slide=0.0, segment_length=0.0,
)  # fmt: skip


@pytest.fixture(scope="module")
def samples() -> dict[str, Sample]:
    return {kind: sample(kind, seconds=12.0) for kind in KINDS}


def found(given: Sample, **options: float) -> mj.JointFinding:
    return mj.find_joint(given.recording, "thigh", "shank", mj.JointOptions(**options))


def arm_errors(finding: mj.JointFinding, given: Sample) -> np.ndarray:
    """Of both arms [m], what is not determined left out."""
    off = np.concatenate([finding.first_arm, finding.second_arm]) - given.arms.ravel()
    return (off - finding.undetermined.T @ (finding.undetermined @ off)).reshape(2, 3)


def axis_errors(finding: mj.JointFinding, given: Sample) -> np.ndarray:
    """Of both axes [deg]; an axis has no sign."""
    axes = np.stack([finding.first_axis, finding.second_axis])
    return np.rad2deg(np.arccos(np.abs((axes * given.axes).sum(1)).clip(0, 1)))


@pytest.mark.parametrize("kind", KINDS)
def test_kind_centre_and_axes_with_white_noise(samples: dict[str, Sample], kind: str) -> None:
    finding = found(samples[kind])
    assert finding.kind == kind
    assert np.abs(arm_errors(finding, samples[kind])).max() < 0.002
    assert len(finding.undetermined) == (kind == "hinge")
    if kind == "ball":
        assert finding.first_axis is None and finding.axis_std is None
    else:
        assert axis_errors(finding, samples[kind]).max() < 0.2


@pytest.mark.parametrize("kind", KINDS)
def test_rough_sensors_stay_within_a_centimetre_and_the_stated_deviations(kind: str) -> None:
    given = sample(kind, profile=ROUGH, seed=3)
    finding = found(given)
    assert finding.kind == kind
    error = arm_errors(finding, given)
    assert np.linalg.norm(error, axis=1).max() < 0.01
    assert (error**2 / finding.arm_std**2).mean() < 2.0**2
    clock = {s: float(given.recording.truth.parameters[f"clock_offset/{s}"]) for s in SENSORS}
    assert finding.clock_offset == pytest.approx(clock["shank"] - clock["thigh"], abs=5e-4)
    if finding.axis_std is not None:
        assert axis_errors(finding, given).max() < 1.5


def test_the_centre_along_a_hinges_axis_is_said_to_be_unknown(samples: dict[str, Sample]) -> None:
    finding, given = found(samples["hinge"]), samples["hinge"]
    direction = finding.undetermined[0]
    expected = given.axes.ravel() / np.sqrt(2)
    assert abs(direction @ expected) == pytest.approx(1.0, abs=1e-4)
    deviation = np.sqrt(direction @ finding.arm_covariance @ direction)
    assert deviation == pytest.approx(mj.JointOptions().arm_sigma)
    assert "Not determined: the centre along" in str(finding)
    assert "any point of a hinge's axis is a centre" in str(finding)
    # What is left is known: both arms' places along the axis against each other, for one.
    rest = np.linalg.eigvalsh(finding.arm_covariance)
    assert rest[-2] < 0.005**2


def test_an_arm_of_a_sensor_that_does_not_turn_is_unknown() -> None:
    finding = found(sample("hinge", seconds=12.0, root_turns=False))
    assert finding.kind == "hinge"
    assert len(finding.undetermined) == 4
    assert (finding.arm_std[0] > 0.1).all()
    assert str(finding).count("the motion does not tell it") == 3


@pytest.mark.parametrize("kind", KINDS)
def test_relative_orientation_and_vertical(samples: dict[str, Sample], kind: str) -> None:
    finding, given = found(samples[kind]), samples[kind]
    at = np.searchsorted(given.time, finding.time - 1e-6)
    relative = Rotation.from_quat(finding.relative, scalar_first=True)
    error = (given.relative[at].inv() * relative).magnitude()
    assert np.rad2deg(np.sqrt((error**2).mean())) < 0.3
    still = np.asarray(given.recording.inertial["thigh"].accelerometer)[:50].mean(0)
    up = Rotation.from_quat(finding.start, scalar_first=True).apply(still / np.linalg.norm(still))
    assert np.rad2deg(np.arccos(up[2])) < 3.0


@pytest.mark.parametrize("kind", KINDS)
def test_the_body_found_holds_the_sensors_as_they_are(
    samples: dict[str, Sample], kind: str, tmp_path: Path
) -> None:
    finding = found(samples[kind])
    made = mj.joint_recording(samples[kind].recording, finding)
    mj.write_recording(tmp_path / "joint.mcap", made)
    recording = mj.read_recording(tmp_path / "joint.mcap")
    assert list(recording.inertial) == ["thigh", "shank"] and recording.truth is None
    body = mj.load_body(recording.body_xml)
    pose = recording.setup.rest.pose
    q = np.asarray(body.qpos0).copy()
    q[3:7] = pose["root"][3:]
    if kind == "ball":
        q[7:] = pose["joint"]
    placed = site_frames(body, q)
    R = Rotation.from_matrix(np.asarray(placed.rotation))
    expected = Rotation.from_quat(finding.relative[0], scalar_first=True)
    # The axes of a hinge are aligned, which the readings' relative orientation is to its error.
    assert ((R[0].inv() * R[1]).inv() * expected).magnitude() < 0.01
    arms = R.apply(np.stack([finding.first_arm, finding.second_arm]))
    np.testing.assert_allclose(np.asarray(placed.position) + arms, 0.0, atol=1e-12)
    # Turned by its joints, the second sensor turns about the axes found.
    if kind == "universal":
        q[7:] = 0.4, -0.7
        R_turned = Rotation.from_matrix(np.asarray(site_frames(body, q).rotation))
        np.testing.assert_allclose(
            (R_turned[0].inv() * R_turned[1]).as_matrix(),
            (Rotation.from_rotvec(0.4 * finding.first_axis) * expected
             * Rotation.from_rotvec(-0.7 * finding.second_axis)).as_matrix(),
            atol=1e-9,
        )  # fmt: skip
    if kind == "hinge":
        q[7] = 0.9
        R_turned = Rotation.from_matrix(np.asarray(site_frames(body, q).rotation))
        turned = (R_turned[0].inv() * R_turned[1]).apply(finding.second_axis)
        np.testing.assert_allclose(turned, finding.first_axis, atol=1e-9)


def test_a_ball_joint_is_no_hinge(samples: dict[str, Sample]) -> None:
    finding = found(samples["ball"])
    with pytest.raises(InputError, match="kind of joint.*'hinge'; valid: ball"):
        mj.joint_recording(samples["ball"].recording, finding, kind="hinge")


def test_strangers_are_doubtful(samples: dict[str, Sample]) -> None:
    recording = samples["ball"].recording
    shank = recording.inertial["shank"]
    backwards = InertialStream(
        shank.time, np.asarray(shank.accelerometer)[::-1], np.asarray(shank.gyroscope)[::-1],
        shank.orientation,
    )  # fmt: skip
    streams = recording.inertial | {"shank": backwards}
    finding = mj.find_joint(dataclasses.replace(recording, inertial=streams), "thigh", "shank")
    assert "Doubtful" in str(finding)
    assert "Doubtful" not in str(found(samples["ball"]))


def test_derivatives_by_the_axes() -> None:
    rng = np.random.default_rng(0)
    R, rate = Rotation.random(30, rng=rng).as_matrix(), rng.normal(size=(30, 3))
    axes, step = rng.normal(size=6), 1e-6
    differences = [
        (_off_plane(axes + step * e, R, rate) - _off_plane(axes - step * e, R, rate)) / (2 * step)
        for e in np.eye(6)
    ]
    derivatives = _off_plane_by_axes(axes, R, rate)
    np.testing.assert_allclose(derivatives, np.stack(differences, 1), atol=1e-8)


def test_wrong_input(samples: dict[str, Sample]) -> None:
    recording = samples["hinge"].recording
    with pytest.raises(InputError, match="unknown sensor 'foot'.*shank"):
        mj.find_joint(recording, "thigh", "foot")
    with pytest.raises(InputError, match="between two sensors"):
        mj.find_joint(recording, "thigh", "thigh")
    with pytest.raises(InputError, match="window -1: must be above 0"):
        mj.JointOptions(window=-1.0)
    cut = {
        name: InertialStream(*(np.asarray(x)[:150] for x in dataclasses.astuple(stream)))
        for name, stream in recording.inertial.items()
    }
    with pytest.raises(InputError, match="1.5 s in common"):
        mj.find_joint(dataclasses.replace(recording, inertial=cut), "thigh", "shank")
    both = recording.inertial | {"shank": recording.inertial["thigh"]}
    with pytest.raises(InputError, match="hardly turn against each other"):
        mj.find_joint(dataclasses.replace(recording, inertial=both), "thigh", "shank")
    thigh = recording.inertial["thigh"]
    blind = dataclasses.replace(thigh, gyroscope=np.full_like(thigh.gyroscope, np.nan))
    with pytest.raises(InputError, match="'thigh' has no gyroscope"):
        mj.find_joint(
            dataclasses.replace(recording, inertial=recording.inertial | {"thigh": blind}),
            "thigh", "shank",
        )  # fmt: skip

"""Bodies from OpenSim models stand as a plain loop over the document says."""

from __future__ import annotations

import numpy as np
import pytest
from naive import naive_frames
from sample_models import sample_model

from mocap_jax.body import load_body
from mocap_jax.body.opensim import (
    PIVOT_PREFIX,
    R_WORLD_GROUND,
    WELDED,
    coordinates_from_poses,
    pose_from_coordinates,
)
from mocap_jax.io.world_frames import world_frames

ROLLING = {"knee", "toe"}


def random_coordinates(body, generator) -> dict[str, float]:
    """Within ranges, and of those that follow none; angles without singularities."""
    names = coordinates_from_poses(body, np.asarray(body.qpos0)[None]).names
    ranges = dict(zip(body.topology.joint_names, np.asarray(body.joint_range), strict=True))
    out = {}
    for name in names:
        low, high = np.clip(ranges.get(name, (-1.0, 1.0)), -1.2, 1.2)
        out[name] = float(generator.uniform(low, high))
    return out


@pytest.fixture(scope="module")
def model():
    text = sample_model()
    return text, load_body(text)


def pivot_error(body, joint: str) -> float:
    """The largest error of a pivot that the model states [m]."""
    from xml.etree import ElementTree

    custom = ElementTree.fromstring(body.xml).find("custom")
    element = next(e for e in custom if e.get("name") == PIVOT_PREFIX + joint)
    return float(element.get("data").split()[0])


def welded(text: str) -> str:
    return text.split(f'name="{WELDED}" data="')[1].split('"')[0]


def test_every_kind_of_joint(model):
    text, body = model
    assert welded(body.xml) == "cap"
    generator = np.random.default_rng(0)
    stated = pivot_error(body, "knee")
    assert 1e-4 < stated < 5e-3
    for _ in range(5):
        values = random_coordinates(body, generator)
        values.pop("copy_angle")
        values.pop("cap_beta", None)
        turn, shift = worst_but_cap(body, text, values)
        assert turn < 1e-9
        assert all(s < (1.001 * stated if n in ROLLING else 1e-9) for n, s in shift.items()), shift


def worst_but_cap(body, text, values):
    """The kneecap of the sample is welded in its default pose, and nothing hangs on it."""
    R, p = world_frames(body, pose_from_coordinates(body, values)[None])
    frames = {n: T for n, T in naive_frames(text, values).items() if n not in ("ground", "cap")}
    at = {n: body.topology.body_index(n) for n in frames}
    turn = max(
        np.abs(R_WORLD_GROUND.as_matrix() @ T[:3, :3] - R[0, at[n]]).max()
        for n, T in frames.items()
    )
    shift = {
        n: float(np.linalg.norm(R_WORLD_GROUND.apply(T[:3, 3]) - p[0, at[n]]))
        for n, T in frames.items()
    }
    return turn, shift


def test_reference_pose_is_the_default_pose(model):
    text, body = model
    turn, shift = worst_but_cap(body, text, {})
    R, p = world_frames(body, np.asarray(body.qpos0)[None])
    R_default, p_default = world_frames(body, pose_from_coordinates(body, {})[None])
    assert np.abs(R - R_default).max() < 1e-12
    assert np.abs(p - p_default).max() < 1e-12
    assert turn < 1e-9


def test_both_layouts_of_the_format_agree(model):
    _, body = model
    old = load_body(sample_model(30000))
    assert old.topology.joint_names == body.topology.joint_names
    for name in ("body_pos", "body_quat", "joint_pos", "joint_axis", "joint_range", "qpos0"):
        a, b = np.asarray(getattr(body, name)), np.asarray(getattr(old, name))
        np.testing.assert_allclose(a, b, atol=1e-12, err_msg=name)


def test_ranges_locks_masses_and_gravity(model):
    _, body = model
    ranges = dict(zip(body.topology.joint_names, np.asarray(body.joint_range), strict=True))
    assert ranges["pin_angle"].tolist() == [-1, 1.5]
    assert not np.isfinite(ranges["u_two"]).any()
    assert "g_y" not in ranges
    assert np.asarray(body.gravity).tolist() == pytest.approx([0, 0, -9.8])
    compiled = body.mujoco_model()
    b = body.topology.body_index("universal")
    assert compiled.body_mass[b] == 3.0
    matrix = np.array([[0.02, 0.001, 0], [0.001, 0.03, 0.002], [0, 0.002, 0.02]])
    moments = np.sort(np.linalg.eigvalsh(matrix))
    np.testing.assert_allclose(np.sort(compiled.body_inertia[b]), moments, rtol=1e-9)


def test_coordinates_come_back_from_poses(model):
    _, body = model
    generator = np.random.default_rng(1)
    for _ in range(3):
        values = random_coordinates(body, generator)
        values["copy_angle"] = 0.5 * values["pin_angle"] + 0.1
        back = coordinates_from_poses(body, pose_from_coordinates(body, values)[None])
        assert dict(zip(back.names, back.values[0], strict=True)) == pytest.approx(values, abs=1e-9)


def test_rajagopal(shared_data):
    path = shared_data / "opensense_walking" / "Rajagopal_2015.osim"
    if not path.is_file():
        pytest.skip(f"no {path}")
    text, body = path.read_text(), load_body(path)
    assert welded(body.xml) == "patella_r patella_l"
    stated = pivot_error(body, "walker_knee_r")
    assert stated < 1e-3
    generator = np.random.default_rng(2)
    for _ in range(3):
        values = random_coordinates(body, generator)
        R, p = world_frames(body, pose_from_coordinates(body, values)[None])
        for name, T in naive_frames(text, values).items():
            if name == "ground" or name.startswith("patella"):
                continue
            b = body.topology.body_index(name)
            assert np.abs(R_WORLD_GROUND.as_matrix() @ T[:3, :3] - R[0, b]).max() < 1e-9
            below = name[:-2] in ("tibia", "talus", "calcn", "toes")
            miss = np.linalg.norm(R_WORLD_GROUND.apply(T[:3, 3]) - p[0, b])
            assert miss < (1.01 * stated if below else 1e-9), name

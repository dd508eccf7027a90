"""Errors of retargeted motions: none against itself, and those that were put in."""

from __future__ import annotations

import dataclasses
import re

import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.motion import Motion, builtin_motion, human, retarget_errors, retarget_table
from mocap_jax.trajectory import Trajectory


@pytest.fixture(scope="module")
def walk() -> Motion:
    motion = builtin_motion("walking")
    whole = motion.trajectory
    return dataclasses.replace(motion, trajectory=Trajectory(whole.time[::40], whole.q[::40]))


def with_hinge(motion: Motion, joint: str, degrees: float) -> Motion:
    topology = motion.body.topology
    at = topology.joint_qpos[topology.joint_index(joint)]
    q = motion.trajectory.q.at[:, at].add(jnp.radians(degrees))
    return dataclasses.replace(motion, trajectory=Trajectory(motion.trajectory.time, q))


def test_a_motion_agrees_with_itself(walk: Motion) -> None:
    errors = retarget_errors(walk, walk)
    assert list(errors.index)[-1] == "all" and len(errors) == 24
    assert np.nanmax(errors.to_numpy()) < 1e-5


def test_a_bent_elbow_shows_where_it_is(walk: Motion) -> None:
    errors = retarget_errors(walk, with_hinge(walk, "LeftForeArm_flexion", 10.0))
    assert errors.loc["LeftForeArm", "bend_mean_deg"] == pytest.approx(10.0)
    assert errors.loc["LeftForeArm", "direction_max_deg"] == pytest.approx(10.0)
    assert errors.loc["LeftHand", "orientation_mean_deg"] == pytest.approx(10.0)
    chord = 100 * 2 * 0.146 * 1.75 * np.sin(np.radians(5.0))
    assert errors.loc["LeftHand", "position_mean_cm"] == pytest.approx(chord)
    assert errors.loc["all", "position_max_cm"] == pytest.approx(chord)
    assert errors.drop(["LeftForeArm", "LeftHand", "all"]).fillna(0).to_numpy().max() < 1e-5


def test_another_size_is_no_error_but_other_proportions_are(walk: Motion) -> None:
    q = walk.trajectory.q
    larger = dataclasses.replace(walk, body=human(height=1.9))
    assert np.nanmax(retarget_errors(walk, larger).to_numpy()) < 1e-5
    longer = Motion("a", human(lengths={"ForeArm": 0.2555 + 0.05}), Trajectory(q[:, 0], q), {})
    errors = retarget_errors(walk, longer)
    assert errors.loc["RightHand", "position_mean_cm"] == pytest.approx(5.0)
    assert errors.loc["all", "orientation_max_deg"] < 1e-5


def test_the_table_explains_itself(walk: Motion) -> None:
    errors = retarget_errors(walk, with_hinge(walk, "LeftForeArm_flexion", 10.0))
    heading, numbers, meanings = retarget_table(errors).split("\n\n")
    assert "one row a segment" in heading and "largest maximum" in heading
    head, *rows = numbers.splitlines()
    columns = re.findall(r"\w+ \w+ \[\w+\]", head)
    quantities = {"orientation": "deg", "direction": "deg", "bend": "deg", "position": "cm"}
    assert columns == [f"{q} {s} [{u}]" for q, u in quantities.items() for s in ("mean", "max")]
    assert all(f"{quantity}: " in meanings for quantity in quantities)
    arm = next(row.split() for row in rows if row.startswith("LeftForeArm"))
    assert arm[5:7] == ["10.0", "10.0"]
    assert next(row.split() for row in rows if row.startswith("Pelvis"))[3:7] == ["-"] * 4
    assert list(errors.columns)[0] == "orientation_mean_deg", "the argument stays as it is"

"""Options for few boards: what they switch on, and the weights of the paper's table 1."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from synthetic import record, small_body

import mocap_jax as mj
from mocap_jax.estimate.sequence.levels import information, initial_levels
from mocap_jax.estimate.sequence.terms import build
from mocap_jax.measurement import gather

RATE = 140.0


def test_sparse_options_use_prior_and_skin() -> None:
    options = mj.sparse_options()
    assert options.pose_prior is mj.default_pose_prior() and options.prior.skin_sigma > 0
    assert not options.noise.adapt and not options.constants.adapt
    own = mj.default_pose_prior().of_segments(["Pelvis", "LeftUpperLeg"])
    assert mj.sparse_options(own).pose_prior is own


def test_weights_of_table_1() -> None:
    """In units of one radian of one sensor: 1, 0.05 and, a frame, 0.003 times the sensors."""

    recording = record(seconds=2.0)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(recording.inertial["pelvis"].time), 1))
    inertial = {k: dataclasses.replace(v, orientation=still) for k, v in recording.inertial.items()}
    recording = dataclasses.replace(recording, inertial=inertial)
    options = mj.table1_options(RATE, sensors=3)
    body = small_body()
    data = gather(recording, body, kinds="AO", root=False, rate_hz=RATE)
    no_prior = dataclasses.replace(options, pose_prior=None)  # it knows no joint of this body
    built = build(data, body, recording.setup, no_prior, root_given=False)
    found = information(built, None, initial_levels(options, 3), 1.0)
    middle = len(data.time) // 2
    # The declared white noise comes on top of the weights.
    assert found["orientation_information"][middle] == pytest.approx(1.0, rel=0.01)
    assert found["force_information"][middle] == pytest.approx(0.05, rel=0.01)
    prior = options.pose_prior
    assert float(data.step) / prior.correlation_time == pytest.approx(3 * 0.003, rel=1e-6)
    assert prior.mobility is None

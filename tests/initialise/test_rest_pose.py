"""The rest hold gives back tilt errors and offsets, and invents none."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax import so3
from mocap_jax.body import site_frames
from mocap_jax.errors import InputError
from mocap_jax.initialise import RestOptions, declared_pose, declared_rest, rest_pose
from mocap_jax.recording import Recording, RestHold, SensorSpec

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "estimate"))
from synthetic import SENSORS, record, small_body


@pytest.fixture(scope="module")
def recording() -> Recording:
    return record(seconds=1.5)


def _tilt(body, q, rest, name: str) -> np.ndarray:
    """World up in the sensor frame."""
    R = site_frames(rest.mounted(body), jnp.asarray(q)).rotation[body.site_index(name)]
    return np.asarray(R)[2]


def test_an_exact_pose_is_left_alone(recording: Recording) -> None:
    body = small_body()
    rest = rest_pose(recording, body)
    assert np.abs(rest.mounting_rotation).max() < 2e-3
    np.testing.assert_allclose(rest.q[7:], body.qpos0[7:], atol=2e-3)
    assert np.abs(rest.gyroscope_bias).max() < 1e-3
    assert np.abs(rest.accelerometer_bias).max() < 0.01
    assert rest.remarks == ()


def test_offsets_and_tilts_are_found(recording: Recording) -> None:
    body = small_body()
    turn, offset = so3.exp(jnp.array([0.06, -0.05, 0.04])), np.array([0.01, -0.02, 0.03])
    stream = recording.inertial["forearm"]
    turned = dataclasses.replace(
        stream,
        accelerometer=np.asarray(stream.accelerometer @ turn),
        gyroscope=np.asarray(stream.gyroscope @ turn) + offset,
    )
    rest = rest_pose(
        dataclasses.replace(recording, inertial=recording.inertial | {"forearm": turned}), body
    )
    i = SENSORS.index("forearm")
    np.testing.assert_allclose(rest.gyroscope_bias[i], offset, atol=1e-3)
    reading = turned.accelerometer[:140].mean(axis=0) - rest.accelerometer_bias[i]
    up = _tilt(body, rest.q, rest, "forearm")
    assert np.degrees(np.arccos(up @ reading / np.linalg.norm(reading))) < 0.2
    # The correction is shared between the joint and the mounting; both stay near their priors.
    assert np.abs(rest.mounting_rotation).max() < 0.1
    assert np.abs(rest.q[7:] - np.asarray(body.qpos0[7:])).max() < 0.1


def test_options_switch_things_off(recording: Recording) -> None:
    body = small_body()
    off = RestOptions(mounting=False, gyroscope_bias=False, accelerometer_bias=False)
    rest = rest_pose(recording, body, options=off)
    assert np.abs(rest.mounting_rotation).max() < 1e-6
    assert np.abs(rest.gyroscope_bias).max() == 0
    assert np.abs(rest.accelerometer_bias).max() < 1e-6


def test_without_a_declared_hold_the_stillest_window_is_used(recording: Recording) -> None:
    setup = dataclasses.replace(recording.setup, rest=None)
    rest = rest_pose(dataclasses.replace(recording, setup=setup), small_body())
    assert rest.still.still and not rest.still.declared
    assert "stillest window" in rest.remarks[0]


def test_declared_pose() -> None:
    body = small_body()
    q = declared_pose(RestHold(0, 1, {"elbow": (0.3,), "shoulder": (2.0, 0, 0, 0)}), body)
    assert q[body.topology.joint_qpos[body.topology.joint_index("elbow")]] == 0.3
    np.testing.assert_allclose(q[7:11], [1, 0, 0, 0])
    with pytest.raises(InputError, match="elbow' has 2 coordinates; a hinge joint has 1"):
        declared_pose(RestHold(0, 1, {"elbow": (0.3, 1.0)}), body)
    with pytest.raises(InputError, match="unknown joint 'elbw'; valid: elbow"):
        declared_pose(RestHold(0, 1, {"elbw": (0.3,)}), body)


def test_declared_rest_is_the_set_up_as_it_stands(recording: Recording) -> None:
    body = small_body()
    hold = RestHold(0.1, 1.2, {"elbow": (0.3,)})
    setup = dataclasses.replace(recording.setup, rest=hold)
    options = RestOptions(
        pose_sigma=0.2, mounting_sigma=0.3, accelerometer_bias_sigma=0.4, gyroscope_bias_sigma=0.5
    )
    rest = declared_rest(dataclasses.replace(recording, setup=setup), body, options)
    np.testing.assert_array_equal(rest.q, declared_pose(hold, body))
    np.testing.assert_allclose(rest.covariance, 0.04 * np.eye(body.nv))
    assert (rest.still.start, rest.still.end, rest.still.declared) == (0.1, 1.2, True)
    for name, sigma in (("accelerometer_bias", 0.4), ("gyroscope_bias", 0.5)):
        assert not getattr(rest, name).any()
        np.testing.assert_array_equal(
            getattr(rest, f"{name}_std"), np.full((len(SENSORS), 3), sigma)
        )
    assert not rest.mounting_rotation.any() and rest.mounting_sigma == 0.3
    np.testing.assert_array_equal(rest.mounting_std, np.full((len(SENSORS), 3), 0.3))
    assert rest.mismatch == 1.0, "nothing was tested"


def test_declared_rest_has_the_shapes_of_an_estimate(recording: Recording) -> None:
    """Programs compiled for the one take the other."""
    body, options = small_body(), RestOptions()
    declared, found = declared_rest(recording, body, options), rest_pose(recording, body)
    for field in dataclasses.fields(declared):
        a, b = (getattr(rest, field.name) for rest in (declared, found))
        assert np.shape(a) == np.shape(b) and type(a) is type(b), field.name


def test_declared_rest_takes_each_sensors_own_site(recording: Recording) -> None:
    body = small_body()
    sensors = (SensorSpec("forearm", "upper_arm", 100.0), SensorSpec("upper_arm", "forearm", 100.0))
    swapped = dataclasses.replace(recording.setup, sensors=sensors)
    rest = declared_rest(dataclasses.replace(recording, setup=swapped), body, RestOptions())
    exchanged = {"forearm": "upper_arm", "upper_arm": "forearm"}
    assert rest.sensors == tuple(recording.inertial)
    assert rest.sites == tuple(body.site_index(exchanged.get(n, n)) for n in rest.sensors)
    nowhere = dataclasses.replace(recording.setup, sensors=(SensorSpec("forearm", "knee", 100.0),))
    with pytest.raises(InputError, match="unknown site 'knee'"):
        declared_rest(dataclasses.replace(recording, setup=nowhere), body, RestOptions())


def test_a_declared_hold_in_a_gap_tells_nothing_and_says_so(recording: Recording) -> None:
    def without(stream):
        return dataclasses.replace(
            stream, accelerometer=np.full_like(stream.accelerometer, np.nan),
            gyroscope=np.full_like(stream.gyroscope, np.nan),
            orientation=np.full_like(stream.orientation, np.nan),
        )  # fmt: skip

    boards = {name: without(stream) for name, stream in recording.inertial.items()}
    rest = rest_pose(dataclasses.replace(recording, inertial=boards), small_body())
    assert np.abs(rest.mounting_rotation).max() < 1e-6 and np.abs(rest.gyroscope_bias).max() == 0
    assert "Nothing was measured in the declared rest hold" in rest.remarks[0]

"""The heading that magnetometers tell: the residual, its derivative, its robustness, its input."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic import small_body

import mocap_jax as mj
from mocap_jax.body import site_frames
from mocap_jax.errors import InputError
from mocap_jax.estimate import check_residual
from mocap_jax.recording import MagneticStream, Recording, Setup
from mocap_jax.residuals.magnetic import magnetic_heading_error

FIELD = np.array([2e-5, 0.0, -4e-5])
TIME = np.arange(8) / 20.0


def readings(turn: float = 0.0) -> Recording:
    """Of a body at rest whose world is turned by an angle against magnetic north."""
    body = small_body()
    R = np.asarray(site_frames(body, body.qpos0).rotation)
    there = Rotation.from_rotvec([0.0, 0.0, turn]).apply(FIELD)
    streams = {
        name: MagneticStream(TIME, np.tile(R[body.site_index(name)].T @ there, (len(TIME), 1)))
        for name in ("pelvis", "forearm")
    }
    return Recording({}, None, None, streams, None, None, Setup(sensors=()), None)


def test_heading_of_a_turned_field() -> None:
    for turn in (-2.0, 0.3, 3.0):
        R = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()
        reading = R.T @ Rotation.from_rotvec([0.0, 0.0, turn]).apply(FIELD)
        error = magnetic_heading_error(jnp.asarray(R), jnp.asarray(reading), 0.0)
        assert float(error) == pytest.approx(turn)
        assert float(magnetic_heading_error(jnp.asarray(R), jnp.asarray(reading), turn)) == (
            pytest.approx(0.0, abs=1e-12)
        )


def test_a_vertical_field_tells_nothing_and_breaks_nothing() -> None:
    error = lambda m: magnetic_heading_error(jnp.eye(3), m, 0.0)  # noqa: E731
    value, slope = jax.value_and_grad(error)(jnp.array([0.0, 0.0, -4e-5]))
    assert float(value) == 0.0 and np.isfinite(np.asarray(slope)).all()


def test_derivative() -> None:
    body = small_body()
    residual, rows = mj.magnetic_heading(readings(0.4), body, TIME, correlation_time=0.2)
    report = check_residual(
        residual, body, np.asarray(body.qpos0)[None], {k: v[0] for k, v in rows.items()}
    )
    assert report.ok, str(report)
    assert np.abs(report.jacobian).max() > 0.1


def test_weight_does_not_depend_on_the_frame_rate_and_outliers_hardly_count() -> None:
    body = small_body()
    q = jnp.asarray(body.qpos0)[None]

    def total(turn: float, loss: str = "cauchy", step: int = 1) -> float:
        residual, rows = mj.magnetic_heading(
            readings(turn), body, TIME[::step], sigma=0.1, correlation_time=2.0, loss=loss,
            sensors=("pelvis",),
        )  # fmt: skip
        values = [
            residual.function(body, q, {k: v[i] for k, v in rows.items()})
            for i in range(len(TIME[::step]))
        ]
        return float(sum((np.asarray(v) ** 2).sum() for v in values))

    assert total(0.05, "none") == pytest.approx(0.25 * 0.05 * len(TIME) / 2.0)
    assert total(0.05, "none", 2) == pytest.approx(total(0.05, "none"))
    assert total(0.05) == pytest.approx(total(0.05, "none"), rel=0.03)
    assert total(2.0) < 0.2 * total(2.0, "none")


def test_missing_readings_do_not_count() -> None:
    body, recording = small_body(), readings()
    stream = recording.magnetic["pelvis"]
    field = np.array(stream.field)
    field[3:6] = np.nan
    recording = dataclasses.replace(
        recording, magnetic=recording.magnetic | {"pelvis": MagneticStream(TIME, field)}
    )
    _, rows = mj.magnetic_heading(recording, body, TIME)
    assert not rows["root_information"][3:6, 0].any()
    assert (rows["root_information"][:3] > 0).all() and np.isfinite(rows["field"]).all()


def test_wrong_input() -> None:
    body = small_body()
    with pytest.raises(InputError, match="no magnetic streams"):
        mj.magnetic_heading(dataclasses.replace(readings(), magnetic={}), body, TIME)
    with pytest.raises(InputError, match="magnetic sensor 'chest'.*pelvis"):
        mj.magnetic_heading(readings(), body, TIME, sensors=("chest",))
    with pytest.raises(InputError, match="must be above 0"):
        mj.magnetic_heading(readings(), body, TIME, sigma=0.0)
    with pytest.raises(InputError, match=r"magnetic heading: time has shape \(1,\); .* two frames"):
        mj.magnetic_heading(readings(), body, TIME[:1])

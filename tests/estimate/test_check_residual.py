"""The derivative self-check finds right derivatives right and wrong ones wrong."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.body import load_body, site_frames
from mocap_jax.errors import InputError
from mocap_jax.estimate import UserResidual, check_residual

BODY = """<mujoco><worldbody><body><joint type="ball"/><geom size=".1"/>
<body pos="0 0 .3"><joint axis="0 1 0"/><geom size=".1"/><site name="tip" pos=".1 0 .3"/>
</body></body></worldbody></mujoco>"""


def _height(body, window, data):
    """The tip's height at the second frame against a measured one."""
    return (site_frames(body, window[1]).position[0, 2:] - data) / 0.01


@jax.custom_jvp
def _double(x):
    return 2 * x


@_double.defjvp
def _wrong(primals, tangents):
    return _double(primals[0]), 2.1 * tangents[0]


@pytest.fixture
def poses() -> np.ndarray:
    return np.array([[1.0, 0, 0, 0, 0.3], [0.8, 0.6, 0, 0, 0.5]])


def test_right_derivative_passes(poses: np.ndarray) -> None:
    report = check_residual(UserResidual("height", _height, 2), load_body(BODY), poses, 0.4)
    assert report.ok, str(report)
    assert report.jacobian.shape == (1, 2, 4)
    assert "agrees" in str(report)


def test_wrong_derivative_is_found(poses: np.ndarray) -> None:
    residual = UserResidual("wrong", lambda body, window, data: _double(window[0, 4:]), 2)
    report = check_residual(residual, load_body(BODY), poses)
    assert not report.ok
    assert "DIFFERS" in str(report)


def test_bad_residuals_are_named(poses: np.ndarray) -> None:
    body = load_body(BODY)
    with pytest.raises(InputError, match="'short'.*expected"):
        check_residual(UserResidual("short", _height, 3), body, poses, 0.4)
    root = UserResidual("root", lambda body, window, data: jnp.sqrt(window[:, 2] * 0.0), 2)
    with pytest.raises(InputError, match="'root'.*not finite"):
        check_residual(root, body, poses)
    matrix = UserResidual("matrix", lambda body, window, data: window, 2)
    with pytest.raises(InputError, match="'matrix'.*vector"):
        check_residual(matrix, body, poses)

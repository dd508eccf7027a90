"""Arrays of a wrong shape are not written: each is named, with the shape it should have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from io_samples import random_recording

from mocap_jax.errors import InputError
from mocap_jax.io import write_recording


@pytest.mark.parametrize(
    ("array", "shape"), [("accelerometer", (60, 2)), ("gyroscope", (59, 3)), ("orientation", (4,))]
)
def test_wrong_shape_of_a_board_is_not_written(body, tmp_path, array, shape) -> None:
    recording = random_recording(body, n=60)
    board = replace(recording.inertial["pelvis"], **{array: np.zeros(shape)})
    wrong = replace(recording, inertial={**recording.inertial, "pelvis": board})
    with pytest.raises(InputError, match=rf"/inertial/pelvis: {array} has shape .*expected \(60, "):
        write_recording(tmp_path / "a.mcap", wrong)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("stream", "array"), [("ranges", "confidence"), ("root", "position")])
def test_wrong_shape_of_other_streams_is_not_written(body, tmp_path, stream, array) -> None:
    recording = random_recording(body, n=60)
    part = getattr(recording, stream)
    wrong = replace(recording, **{stream: replace(part, **{array: getattr(part, array)[1:]})})
    with pytest.raises(InputError, match=f"{array} has shape"):
        write_recording(tmp_path / "a.mcap", wrong)
    assert not list(tmp_path.iterdir())

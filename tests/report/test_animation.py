"""Moving pictures: as many frames as asked for, of the right kind, whole or not at all."""

import numpy as np
import pytest
from PIL import Image
from small_person import person, recording, solution, swing

from mocap_jax.errors import InputError
from mocap_jax.report import write_animation


@pytest.fixture(scope="module")
def motion():
    return swing(person())


@pytest.mark.parametrize("suffix", ["gif", "webp", "png"])
def test_frames_move(tmp_path, motion, suffix):
    path = tmp_path / f"swing.{suffix}"
    made = solution(person(), motion)
    write_animation(path, made, recording(motion), rate_hz=3.0, width=120)
    seconds = float(motion.time[-1] - motion.time[0])
    with Image.open(path) as picture:
        assert picture.n_frames == max(int(3 * seconds), 2)
        first = np.asarray(picture.convert("RGB"), float)
        picture.seek(picture.n_frames // 2)
        later = np.asarray(picture.convert("RGB"), float)
    assert first.shape[1] == 120 and np.abs(later - first).max() > 50


def test_wrong_arguments_leave_nothing(tmp_path, motion):
    made = solution(person(), motion)
    with pytest.raises(InputError, match="valid: .gif, .webp, .png"):
        write_animation(tmp_path / "swing.mp4", made)
    with pytest.raises(InputError, match="above 0"):
        write_animation(tmp_path / "swing.gif", made, rate_hz=0.0)
    assert not list(tmp_path.iterdir())

"""Wrong arguments of the human body give one clear error; natural ones are taken."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.errors import InputError
from mocap_jax.motion import human, with_segment_lengths


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"mass": "61"}, "mass must be 5 to 300 kg, got '61'"),
        ({"height": None}, "height must be 0.5 to 2.5 m, got None"),
        ({"lengths": [0.29]}, "lengths must map segments to metres"),
    ],
)
def test_wrong_kinds_are_refused(arguments: dict, text: str) -> None:
    with pytest.raises(InputError, match=text):
        human(**arguments)


def test_sex_in_any_case() -> None:
    assert human(sex="Female").xml == human(sex="FEMALE").xml == human(sex="female").xml
    assert human(sex="Male").xml == human(sex="male").xml != human(sex="female").xml
    with pytest.raises(InputError, match=r"unknown sex 'Boy'; valid: .*female"):
        human(sex="Boy")
    with pytest.raises(InputError, match="unknown sex '1'"):
        human(sex=1)  # type: ignore[arg-type]


def test_lengths_by_mapping_or_by_one_name() -> None:
    body = human()
    mapped = with_segment_lengths(body, {"UpperArm": 0.3})
    named = with_segment_lengths(body, np.array([0.3]), "UpperArm")
    np.testing.assert_array_equal(mapped.body_pos, named.body_pos)
    assert not np.allclose(mapped.body_pos, body.body_pos)

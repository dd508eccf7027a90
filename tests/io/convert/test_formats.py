"""Which format a source is."""

from __future__ import annotations

import pytest

from mocap_jax.cli.convert import _CHOICES
from mocap_jax.cli.convert import FORMATS as SHOWN
from mocap_jax.errors import InputError
from mocap_jax.io import convert


def test_unknown_sources_name_the_formats(tmp_path):
    (tmp_path / "a.doc").write_text("x")
    with pytest.raises(InputError, match=r"of no known format.*xsens-mt.*mvnx.*csv"):
        convert.read_source(tmp_path / "a.doc")
    with pytest.raises(InputError, match="unknown format 'xsens'; valid: xsens-mt"):
        convert.read_source(tmp_path, "xsens")


def test_the_command_line_shows_what_there_is():
    assert list(SHOWN) != [] and set(SHOWN) == set(convert.FORMATS)
    for key, there in (
        ("accelerometer_unit", convert.ACCELEROMETER_UNITS),
        ("gyroscope_unit", convert.GYROSCOPE_UNITS),
        ("magnetometer_unit", convert.MAGNETOMETER_UNITS),
        ("quaternion_order", convert.QUATERNION_ORDERS),
        ("quaternion_direction", convert.QUATERNION_DIRECTIONS),
        ("acceleration", convert.ACCELERATIONS),
        ("world_up", convert.WORLD_UPS),
    ):
        assert _CHOICES[key] == tuple(there)

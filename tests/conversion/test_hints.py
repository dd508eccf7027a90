"""Each finding names the one option that puts it right, whatever the numbers were taken for."""

from __future__ import annotations

import numpy as np
import pytest

from mocap_jax.conversion.hints import hint
from mocap_jax.initialise.orientation_check import _READINGS
from mocap_jax.initialise.sensor_units import _FORCE_FACTORS, _RATE_FACTORS
from mocap_jax.io.convert import ACCELEROMETER_UNITS, GYROSCOPE_UNITS, Convention


@pytest.mark.parametrize(("unit", "size"), ACCELEROMETER_UNITS.items())
@pytest.mark.parametrize(("truth", "wanted"), ACCELEROMETER_UNITS.items())
def test_every_wrong_accelerometer_unit_leads_to_the_right_one(unit, size, truth, wanted):
    """By the check's own sentences: those of the factor between the two, if it has one."""
    for factor, text in _FORCE_FACTORS.items():
        if abs(factor * size / wanted - 1) < 0.01:
            found = hint(f"All: accelerometer {text}.", Convention(accelerometer_unit=unit))
            assert found == f" Option: --accelerometer-unit {truth}."


@pytest.mark.parametrize(("unit", "size"), GYROSCOPE_UNITS.items())
def test_every_wrong_gyroscope_unit_leads_to_the_right_one(unit, size):
    for factor, text in _RATE_FACTORS.items():
        right = [n for n, x in GYROSCOPE_UNITS.items() if np.isclose(x, size * factor, rtol=0.01)]
        found = hint(f"Sensor a: gyroscope {text}.", Convention(gyroscope_unit=unit))
        assert found == (f" Option: --gyroscope-unit {right[0]}." if right else "")


def test_quaternions_lead_from_what_they_were_taken_for_to_the_other():
    for text in filter(None, _READINGS):
        order, turned = "quaternions look" in text, "world-to-sensor" in text
        found = hint(f"All: {text}.")
        assert ("--quaternion-order xyzw" in found) == order
        assert ("--quaternion-direction world-to-sensor" in found) == turned
        assert found.startswith(" Option: ")
    taken = Convention(quaternion_order="xyzw", quaternion_direction="world-to-sensor")
    text = "orientations look like world-to-sensor, read as sensor-to-world"
    assert hint(text, taken) == " Option: --quaternion-direction sensor-to-world."


def test_two_options_where_either_may_be_right():
    assert hint("gravity points down: ...") == " Options: --gravity-sign -1 or --world-up -z."
    assert hint("its world has its y axis up, not z") == " Option: --world-up y."
    assert "--acceleration free-world" in hint("accelerometer gravity seems to be removed (...)")
    assert hint("gyroscope and accelerometer disagree: ...") == ""

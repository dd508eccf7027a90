"""The same fault of many sensors is one sentence."""

from mocap_jax.initialise.check_sensors import SensorCheck
from mocap_jax.initialise.fault_groups import grouped_faults


def test_numbers_that_differ_become_a_range():
    text = "accelerometer reads in g; m/s^2 is expected (gravity at rest reads {}, not 9.81)"
    faults = {f"s{i}": (text.format(x),) for i, x in enumerate((0.998, 1.02, 1.0))}
    (line,) = grouped_faults(faults | {"sound": ()})
    assert line == f"Sensors s0, s1, s2: {text.format('0.998 to 1.02')}."
    assert SensorCheck(faults).sentences == grouped_faults(faults)


def test_different_faults_stay_apart():
    faults = {"a": ("reads half", "turned by 90 deg"), "b": ("reads twice",), "c": ()}
    assert grouped_faults(faults) == (
        "Sensor a: reads half.", "Sensor a: turned by 90 deg.", "Sensor b: reads twice.",
    )  # fmt: skip


def test_names_with_digits_are_no_numbers():
    faults = {"a": ("fits T8 -2.5 deg off, sensor_1",), "b": ("fits T8 3e-2 deg off, sensor_1",)}
    assert grouped_faults(faults) == ("Sensors a, b: fits T8 -2.5 to 3e-2 deg off, sensor_1.",)

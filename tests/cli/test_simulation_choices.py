"""`simulate`: rates, durations and what boards measure."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mocap_jax.cli.main import build_parser
from mocap_jax.cli.raw_choices import raw_options
from mocap_jax.cli.simulation_choices import simulation_options
from mocap_jax.io import read_recording
from mocap_jax.simulation import SimulationOptions, earth_field
from mocap_jax.simulation.raw import RawOptions


def asked(*options: str) -> SimulationOptions:
    return simulation_options(
        build_parser().parse_args(["simulate", "walking", "-o", "a.mcap", *options])
    )


def test_nothing_asked_is_the_default():
    assert asked() == SimulationOptions()


def test_every_argument_sets_its_option():
    found = asked(
        "--rate", "60", "--rest", "3", "--blend", "2", "--cutoff", "20", "--fastest-joint", "80",
        "--pulse-interval", "0.01", "--max-range", "4", "--orientations", "--magnetometers", "50",
    )  # fmt: skip
    wanted = SimulationOptions(
        inertial_rate_hz=60.0, rest_s=3.0, blend_s=2.0, cutoff_hz=20.0, fastest_joint=80.0,
        pulse_interval_s=0.01, max_range_m=4.0, orientations=True,
        magnetic_field=earth_field(np.deg2rad(50.0)),
    )  # fmt: skip
    assert found == wanted
    default = SimulationOptions()
    same = [
        f.name for f in dataclasses.fields(default)
        if getattr(found, f.name) == getattr(default, f.name)
    ]  # fmt: skip
    assert same == ["speed_of_sound", "start_utc_ns"], "the others have an argument"


def test_levels_and_the_room_are_as_asked():
    asked_for = ["--raw", "--raw-set", "floor_m=0", "--raw-set", "interference=600"]
    parsed = build_parser().parse_args(["simulate", "walking", "-o", "a.mcap", *asked_for])
    assert raw_options(parsed) == RawOptions(floor_m=0.0, interference=600.0)


def test_longer_slots_hear_farther_unless_told_otherwise():
    assert asked("--pulse-interval", "0.016").max_range_m == pytest.approx(5.5)
    assert asked("--pulse-interval", "0.004").max_range_m == pytest.approx(1.375)
    assert asked("--pulse-interval", "0.016", "--max-range", "3").max_range_m == 3.0
    assert asked("--pulse-interval", "1").max_range_m == 20.0, "no sound comes farther"


def test_the_recording_is_as_asked(run, tmp_path):
    output = tmp_path / "part.mcap"
    outcome = run(
        "simulate", "walking:1-2.5", "-o", output, "--sensors", "sip6_head", "--rate", "60",
        "--rest", "1", "--magnetometers", "50",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    recording = read_recording(output)
    assert recording.setup.rest.end == 1.0
    for stream in (*recording.inertial.values(), *recording.magnetic.values()):
        np.testing.assert_allclose(np.diff(stream.time), 1 / 60, atol=1e-6)
    assert len(recording.magnetic) == 6 == len(recording.inertial)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--rate", "0"], "from 10 to 5000"), (["--rest", "-1"], "from 0.5 to 600"),
        (["--magnetometers", "120"], "from -90 to 90"),
        (["--raw", "--rate", "60"], "--rate: the driver box"),
        (["--raw-set", "floor_m=0"], "--raw-set is for --raw"),
        (["--raw", "--raw-set", "flor_m=0"], "unknown name 'flor_m'; valid: floor_m"),
        (["--raw", "--raw-set", "floor_m=low"], "floor_m=low: expected NAME=NUMBER"),
        (["--raw", "--raw-set", "wall_reflection=2"], "wall_reflection 2: valid are 0 to 1"),
        (["--raw", "--raw-set", "chunk_s=1e-7"], "--raw-set: chunk_s 1e-07: valid are 0.001 to 60"),
        (["--raw", "--raw-set", "floor_m=nan"], "--raw-set: floor_m nan: valid are heights"),
        (["--raw", "--magnetometers", "50"], "--magnetometers: the driver box"),
    ],
)  # fmt: skip
def test_wrong_values_are_wrong_usage(refused, tmp_path, options, word):
    refused(["simulate", "walking", "-o", tmp_path / "a.mcap", *options], 2, word)

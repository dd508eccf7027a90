"""Set-ups as TOML."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from io_samples import random_setup

from mocap_jax.errors import InputError
from mocap_jax.io import read_setup, setup_from_toml, setup_to_toml, write_setup
from mocap_jax.recording import NoiseFigures, RestHold, SensorSpec, Setup

positive = st.floats(1e-12, 1e9)
names = st.text(st.characters(codec="utf-8", exclude_categories=["Cs"]), min_size=1, max_size=9)


@given(
    rate=positive, interval=positive, start=st.floats(-1e6, 1e6), joint=names,
    facts=st.dictionaries(
        names, st.one_of(st.text(), st.integers(-(2**62), 2**62), st.booleans(),
                         st.floats(allow_nan=False)),
    ),
)  # fmt: skip
def test_any_set_up_survives(rate, interval, start, joint, facts) -> None:
    setup = Setup(
        sensors=(SensorSpec(joint, "site", rate),),
        sources=(joint,),
        pulse_interval=interval,
        rest=RestHold(start, start + 1, {joint: (rate,), joint + "b": (1.0, 0.0, 0.0, 0.0)}),
        provenance=facts,
    )
    assert setup_from_toml(setup_to_toml(setup)) == setup


def test_defaults_and_files(tmp_path) -> None:
    assert setup_from_toml("") == Setup()
    assert setup_from_toml('[[sensors]]\nname = "a"\nrate_hz = 100').sensors == (
        SensorSpec("a", "a", 100.0),
    )
    write_setup(tmp_path / "s.toml", random_setup())
    assert read_setup(tmp_path / "s.toml") == random_setup()
    assert setup_to_toml(replace(random_setup(), rest=None)).count("[rest]") == 0


@pytest.mark.parametrize(("text", "expected"), [
    ("x = ", "not valid TOML"),
    ("speed_of_sond = 3.0", "unknown key 'speed_of_sond'; valid: speed_of_sound"),
    ("speed_of_sound = 'fast'", "'speed_of_sound' must be a number, not 'fast'"),
    ("pulse_interval = 0", "'pulse_interval' must be greater than 0"),
    ("pulse_interval = true", "must be a number"),
    ("score_from = nan", "must be a number"),
    ("sources = 'a'", "'sources' must be a list"),
    ("noise = 3", "'noise' must be a table"),
    ("[noise]\ngyro = 0.1", r"unknown key in \[noise\] 'gyro'; valid: .*gyroscope"),
    ("[noise]\ngyroscope = -0.1", "'noise.gyroscope' must be greater than 0"),
    ("[rest]\nstart = 0", r"\[rest\] lacks 'end'"),
    ("[rest]\nstart = 2\nend = 1", "must be after"),
    ("[rest]\nstart = 0\nend = 1\n[rest.pose]\nknee = [1.0, 2.0]", "rest.pose.knee has 2 numbers"),
    ("[[sensors]]\nrate_hz = 3", r"sensors\[0\] lacks 'name'"),
    ("[[sensors]]\nname = 'a'\nrate_hz = 3\nsit = 'b'", r"unknown key in \[sensors\[0\]\] 'sit'"),
    ("[[sensors]]\nname = 'a'\nrate_hz = 3\n[[sensors]]\nname = 'a'\nrate_hz = 3", "2 times"),
    ("sensors = 3", "array of tables"),
    ("[provenance]\na = [1]", "provenance.a must be"),
])  # fmt: skip
def test_faults_name_the_key(text, expected) -> None:
    with pytest.raises(InputError, match=rf"^suit\.toml: .*{expected}") as caught:
        setup_from_toml(text, "suit.toml")
    assert "\n" not in str(caught.value)


def test_unreadable_files(tmp_path) -> None:
    with pytest.raises(InputError, match="no such set-up file"):
        read_setup(tmp_path / "none.toml")
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not a text file"):
        read_setup(tmp_path / "b.toml")


def test_published_schema_is_complete_and_its_example_reads() -> None:
    text = (Path(__file__).parents[2] / "docs" / "setup_toml.md").read_text()
    example = text.split("```toml\n")[1].split("```")[0]
    setup = setup_from_toml(example)
    assert setup.sensors[1] == SensorSpec("right_thigh", "right_thigh", 140.0)
    assert setup.rest.pose["RightKnee"] == (0.05,)
    for key in [*(f.name for f in fields(Setup)), *(f.name for f in fields(NoiseFigures))]:
        assert f"`{key}`" in text or f"[{key}]" in text
    for f in fields(NoiseFigures):
        line = next(x for x in text.splitlines() if x.startswith(f"| `{f.name}` |"))
        assert float(line.split("|")[2]) == f.default

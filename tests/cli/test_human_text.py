"""`--body human:height=1.80,...`: what it means, and where it is understood."""

from __future__ import annotations

import argparse
import dataclasses

import pytest

from mocap_jax.body import load_body
from mocap_jax.cli import estimate_recording
from mocap_jax.cli.body_choice import add_body_arguments, chosen_body
from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.cli.human_text import HumanSize, human_of, is_human, read_human
from mocap_jax.errors import InputError
from mocap_jax.io import write_recording
from mocap_jax.motion import human, segment_lengths


def test_all_of_it_is_read():
    text = "human:height=1.80,mass=75,sex=f,UpperLeg=0.45, LeftHand=0.2"
    assert read_human(text) == HumanSize(1.8, 75.0, "female", {"UpperLeg": 0.45, "LeftHand": 0.2})
    assert read_human("human") == HumanSize()
    wanted = human(1.8, 75.0, "female", {"UpperLeg": 0.45, "LeftHand": 0.2})
    assert human_of(read_human(text)).xml == wanted.xml
    assert human_of(read_human("human:height=1.6")).xml == human(1.6, 70 * (1.6 / 1.75) ** 2).xml


def test_files_are_not_taken_for_it():
    assert is_human("human") and is_human("human:mass=60")
    assert not any(map(is_human, (None, "", "human.xml", "human-like-clip", "me/human")))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("human:tall", "'tall' cannot be read; expected height=METRES"),
        ("human:", "expected height=METRES"), ("human:height=tall", "'height=tall' cannot be"),
        ("human:sex=x", "unknown sex 'x'; valid: f, m"), ("human:mass=1,mass=2", "given twice"),
        ("human:height=9", "height must be 0.5 to 2.5 m"), ("human:Arm=1", "unknown segment 'Arm'"),
    ],
)  # fmt: skip
def test_wrong_ones_are_wrong_usage(text, words):
    with pytest.raises(UsageError, match=words):
        human_of(read_human(text))


def test_beside_the_other_options():
    parser = argparse.ArgumentParser()
    add_body_arguments(parser)
    given = parser.parse_args(["--body", "human:height=1.7", "--mass", "60"])
    assert chosen_body(given).xml == human(1.7, 60.0).xml
    twice = parser.parse_args(["--body", "human:height=1.7", "--height", "1.8"])
    with pytest.raises(UsageError, match="height is given twice"):
        chosen_body(twice)


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list:
    """What `reconstruct` would have estimated with."""
    given: list = []

    def solve(recording, body, **options):
        given.append((recording, body))
        raise InputError("enough")

    monkeypatch.setattr(estimate_recording, "solve", solve)
    return given


def test_reconstruct_dresses_the_human(run, solved, recording, tmp_path):
    """A recording without a body: sensors go where the provenance says."""
    facts = {"segment/pelvis": "Pelvis", "segment/chest": "T8"}
    setup = dataclasses.replace(recording.setup, rest=None, provenance=facts)
    path = tmp_path / "plain.mcap"
    write_recording(path, dataclasses.replace(recording, setup=setup, body_xml=None, truth=None))
    outcome = run("reconstruct", path, "--body", "human:height=1.62,mass=55,sex=f")
    assert outcome.code == 1 and "enough" in outcome.err, outcome.err
    ((worn, body),) = solved
    assert segment_lengths(body) == pytest.approx(segment_lengths(human(1.62, 55.0, "female")))
    assert set(body.topology.site_names) == {"pelvis", "chest"}
    assert load_body(worn.body_xml).topology == body.topology


def test_reconstruct_refuses_a_body_of_another_kind(refused, recording_file):
    refused(["reconstruct", recording_file, "--body", "human"], 1, "still.mcap", "another kind")
    refused(["reconstruct", recording_file, "--body", "human:x"], 2, "'x' cannot be read")

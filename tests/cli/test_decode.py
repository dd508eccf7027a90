"""`simulate --raw` and `decode`, on two segments that turn for a second and a half."""

from __future__ import annotations

import numpy as np

from mocap_jax.io import read_recording

SUIT = """
[[boards]]
name = "pelvis"
segment = "Pelvis"
position = [0.1, 0.0, 0.0]
orientation = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0]

[[sources]]
name = "belly"
segment = "Pelvis"
position = [0.12, 0.0, 0.05]
orientation = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0]

[[anchors]]
name = "lamp"
position = [3.0, 0.0, 3.2]
orientation = [0.0, 1.0, 0.0, 0.0]
emits = true

[[anchors]]
name = "ear"
position = [0.7, 0.0, 1.2]
orientation = [0.7071067811865476, 0.0, -0.7071067811865476, 0.0]
"""


def test_simulated_wires_are_decoded(run, nod, tmp_path):
    raw, out = tmp_path / "nod.raw.mcap", tmp_path / "nod.mcap"
    made = run("simulate", nod, "--raw", "-o", raw)
    assert made.code == 0, made.err
    assert "raw" in made.out and "boards" in made.out
    for detector in ("matched", "inflection"):
        outcome = run("decode", raw, "-o", out, "--detector", detector)
        assert outcome.code == 0, outcome.err
        assert f"detector {detector}" in outcome.out and "0 lost" in outcome.out
    recording = read_recording(out)
    assert recording.truth is not None and recording.root is not None
    assert recording.setup.provenance["detector"] == "inflection"
    first = next(iter(recording.inertial.values()))
    assert np.asarray(first.accelerometer).shape[0] > 150
    assert len(recording.ranges.time) > 20


def test_decode_takes_the_air_and_names_gaps(run, nod, tmp_path):
    raw, out = tmp_path / "nod.raw.mcap", tmp_path / "nod.mcap"
    assert run("simulate", nod, "--raw", "-o", raw).code == 0
    outcome = run("decode", raw, "-o", out, "--temperature", "30", "--humidity", "60")
    assert outcome.code == 0 and "no samples" not in outcome.out
    assert 350 < read_recording(out).setup.speed_of_sound < 352
    for option, value in (("--humidity", "101"), ("--temperature", "300")):
        outcome = run("decode", raw, "-o", out, option, value)
        assert outcome.code == 2 and option in outcome.err and "from" in outcome.err


def test_wrong_detector_and_wrong_file_say_what_is_valid(run, recording_file, tmp_path):
    out = tmp_path / "out.mcap"
    outcome = run("decode", recording_file, "-o", out, "--detector", "peak")
    assert outcome.code == 2 and "matched, inflection" in outcome.err
    outcome = run("decode", recording_file, "-o", out)
    assert outcome.code == 1 and "not a raw recording" in outcome.err
    outcome = run("decode", tmp_path / "absent.mcap", "-o", out)
    assert outcome.code == 1 and "No such file" in outcome.err
    assert not out.exists()


def test_orientations_cannot_be_sent(run, tmp_path):
    outcome = run("simulate", "routine", "--raw", "--orientations", "-o", tmp_path / "a.mcap")
    assert outcome.code == 2 and "--orientations" in outcome.err


def test_anchors_too_far_for_the_slots_are_told(run, nod, tmp_path):
    """When they are simulated and when they are decoded; longer slots hear them."""
    worn, out = tmp_path / "worn.toml", tmp_path / "far.mcap"
    worn.write_text(SUIT)
    asked = ["simulate", nod, "--sensors", worn, "--profile", "ideal", "-o", out]
    (line,) = run(*asked).error_lines
    assert "no distance is measured to anchor/lamp: the slots hear 2.75 m" in line
    assert "--pulse-interval" in line
    (line,) = run(*asked, "--pulse-interval", "0.016", "--max-range", "2").error_lines
    assert line.endswith("no distance is measured to anchor/lamp: --max-range says 2 m")
    (line,) = run(*asked, "--raw").error_lines
    assert "nothing comes near enough to anchor/lamp" in line and "--pulse-interval" in line
    (line,) = run("decode", out, "-o", tmp_path / "heard.mcap").error_lines
    assert line.endswith("anchor/lamp: too faint, left out (slots of 8 ms hear 2.75 m)")
    longer = run(*asked, "--raw", "--pulse-interval", "0.016")
    assert longer.code == 0 and longer.err == ""
    heard = run("decode", out, "-o", tmp_path / "heard.mcap")
    assert heard.code == 0 and heard.err == ""
    ranges = read_recording(tmp_path / "heard.mcap").ranges
    lamp = np.asarray(ranges.source) == ranges.source_names.index("anchor/lamp")
    assert lamp.sum() > 20 and np.asarray(ranges.distance)[lamp].min() > 3.0

"""True constants in the estimator's terms, and tables that set them beside the estimates."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from small_person import person_xml, recording, setup, solution, swing

from mocap_jax.body import load_body
from mocap_jax.recording import InertialStream, RestHold
from mocap_jax.report import write_report
from mocap_jax.report.constant_tables import constant_tables, constants_verdict
from mocap_jax.report.constant_truth import constant_truth
from mocap_jax.report.steps import steps_of

TURN, SHIFT = np.array([0.1, -0.2, 0.05]), np.array([0.01, 0.02, -0.03])
NOMINAL = Rotation.from_euler("z", 90, degrees=True)


def text(rotation: Rotation) -> str:
    return " ".join(f"{x:.12g}" for x in rotation.as_quat(scalar_first=True))


def worn_xml(scale: float, shift: np.ndarray, turn: np.ndarray) -> str:
    """The person with a board that is turned, shifted (in its own frame), and a source."""
    place = NOMINAL.apply(shift)
    site = (
        f'<site name="head" pos="{place[0]} {place[1]} {place[2]}" '
        f'quat="{text(NOMINAL * Rotation.from_rotvec(turn))}"/>'
    )
    source = f'<site name="source/hat" pos="0 0 {0.1 + shift[2]}"/>'
    return person_xml(scale).replace('<site name="head"/>', site + source)


@pytest.fixture(scope="module")
def made():
    nominal = load_body(worn_xml(1.0, np.zeros(3), np.zeros(3)))
    worn = dataclasses.replace(setup(), sources=("source/hat",), rest=RestHold(0.0, 0.1))
    return solution(nominal, swing(nominal), setup=worn)


@pytest.fixture(scope="module")
def reference(made):
    """True lengths 3 % larger; a gyroscope bias that drifts by 0.001 rad/s each frame."""
    drift = 1e-3 * np.arange(60)[:, None] * [1.0, 0.0, 0.0]
    board = InertialStream(np.arange(60) / 100, np.ones((60, 3)), np.ones((60, 3)),
                           np.full((60, 4), np.nan))  # fmt: skip
    plain = recording(made.trajectory)
    truth = dataclasses.replace(
        plain.truth, body_xml=worn_xml(1.03, SHIFT, TURN),
        parameters={
            "gyroscope_bias/head": jnp.array([0.01, 0.02, 0.03]),
            "gyroscope_drift/head": jnp.asarray(drift),
            "accelerometer_bias/head": jnp.array([0.1, 0.0, 0.0]),
            "speed_of_sound": jnp.array(0.99 * 343.0),
            "source_offset/hat": jnp.array(0.004),
            "gyroscope_scale/head": jnp.array([1.01, 1.0, 0.98]),
            "clock_offset/head": jnp.array(0.002),
        },
    )  # fmt: skip
    return dataclasses.replace(
        plain, truth=truth, setup=made.setup, inertial={"head": board},
        body_xml=worn_xml(1.0, np.zeros(3), np.zeros(3)),
    )  # fmt: skip


def test_places_and_lengths_come_from_the_true_body(made, reference):
    truth = constant_truth(made, reference)
    np.testing.assert_allclose(truth["mounting_offset/head"], SHIFT, atol=1e-9)
    np.testing.assert_allclose(truth["mounting_rotation/head"], TURN, atol=1e-9)
    np.testing.assert_allclose(truth["source_position/hat"], [0, 0, SHIFT[2]], atol=1e-9)
    np.testing.assert_allclose(truth["segment_length/LeftForeArm"], [0.03], atol=1e-9)
    np.testing.assert_allclose(truth["speed_of_sound/air"], [-0.01], atol=1e-9)
    np.testing.assert_allclose(truth["source_offset/hat"], [0.004])


def test_mountings_told_from_another_body_do_not_count(made, reference):
    told = dict(reference.truth.parameters) | {"mounting_rotation/head": np.array([0.5, 0.0, 0.0])}
    stale = dataclasses.replace(
        reference, truth=dataclasses.replace(reference.truth, parameters=told)
    )
    truth = constant_truth(made, stale)
    np.testing.assert_allclose(truth["mounting_rotation/head"], TURN, atol=1e-9)


def test_drifting_biases_are_means_over_the_data_used(made, reference):
    whole = constant_truth(made, reference)["gyroscope_bias/head"]
    np.testing.assert_allclose(whole, [0.01 + 1e-3 * 29.5, 0.02, 0.03], atol=1e-9)
    filtered = dataclasses.replace(made, method="ekf_smoothed")
    rest = constant_truth(filtered, reference)["gyroscope_bias/head"]
    np.testing.assert_allclose(rest, [0.01 + 1e-3 * 4.5, 0.02, 0.03], atol=1e-9)
    steady = constant_truth(made, reference)["accelerometer_bias/head"]
    np.testing.assert_allclose(steady, [0.1, 0.0, 0.0])


def test_scales_are_errors_and_clocks_are_as_told(made, reference):
    truth = constant_truth(made, reference)
    np.testing.assert_allclose(truth["gyroscope_scale/head"], [0.01, 0.0, -0.02], atol=1e-12)
    np.testing.assert_allclose(truth["clock_offset/head"], [0.002])


def test_biases_that_walk_are_set_beside_their_course_at_the_knots(made, reference):
    knots = np.array([0.0, 29.5, 59.0])[:, None] * [1e-3, 0.0, 0.0] + [0.01, 0.02, 0.03]
    key = "gyroscope_bias_walk/head"
    walked = dataclasses.replace(
        made, calibration={key: knots + [0.0, 0.005, 0.0]},
        calibration_std={key: np.full((3, 3), 1e-3)},
    )  # fmt: skip
    np.testing.assert_allclose(constant_truth(walked, reference)[key], knots, atol=1e-12)
    (table,) = constant_tables({"Optimiser": walked}, reference)["Optimiser"]
    assert [row.head for row in table.table.rows] == [f"head, knot {i}" for i in (1, 2, 3)]
    assert (table.far, table.known) == (3, 9) and table.table.rows[1].off == (2,)


def test_other_frames_and_recordings_without_truth_give_nothing(made, reference):
    assert not constant_truth(made, None)
    assert not constant_truth(made, dataclasses.replace(reference, truth=None))
    turned = reference.truth.body_xml.replace('name="Head"', 'name="Head" euler="0 0 0.5"')
    turned = turned.replace('name="LeftForeArm" pos="0', 'name="LeftForeArm" pos="0.1')
    other = dataclasses.replace(
        reference, truth=dataclasses.replace(reference.truth, body_xml=turned, parameters={})
    )
    truth = constant_truth(made, other)
    assert not {"mounting_offset/head", "source_position/hat", "mounting_rotation/head"} & set(
        truth
    )
    assert "segment_length/LeftForeArm" not in truth and "segment_length/LeftHand" in truth


@pytest.fixture(scope="module")
def estimated(made):
    """The first component lies 2, the second 4 deviations from the truth; a length lies on it."""
    return dataclasses.replace(
        made,
        calibration={
            "mounting_offset/head": SHIFT + [0.002, 0.004, 0.0],
            "segment_length/LeftForeArm": np.array([0.03]),
        },
        calibration_std={
            "mounting_offset/head": np.full(3, 0.001),
            "segment_length/LeftForeArm": np.array([0.01]),
        },
    )


def test_tables_hold_estimate_deviation_and_truth_and_mark_what_is_far(estimated, reference):
    offsets, lengths = constant_tables({"Optimiser": estimated}, reference)["Optimiser"]
    assert offsets.title == "Mounting offset [mm]"
    assert offsets.table.heads == ("Sensor", "x", "truth", "y", "truth", "z", "truth")
    row = offsets.table.rows[0]
    assert row.head == "head"
    assert row.cells[:4] == ("+12.0 \u00b1 1.0", "+10.0", "+24.0 \u00b1 1.0 *", "+20.0")
    assert row.off == (2,) and (offsets.far, offsets.known) == (1, 3)
    assert lengths.table.heads == ("Segment", "estimate", "truth")
    assert lengths.table.rows[0].cells == ("+3.00 \u00b1 1.00", "+3.00")
    assert not lengths.table.rows[0].off


def test_verdict_counts_all_kinds(estimated, reference):
    text = constants_verdict(constant_tables({"Optimiser": estimated}, reference))
    assert "deviations from the truth: 1 of 4 (Optimiser)." in text
    assert text.endswith("The deviations stated by Optimiser are too small.")
    good = dataclasses.replace(
        estimated, calibration=estimated.calibration | {"mounting_offset/head": SHIFT}
    )
    text = constants_verdict(constant_tables({"Optimiser": good}, reference))
    assert "0 of 4 (Optimiser)" in text and text.endswith("can be relied on.")


def test_without_truth_or_deviation_nothing_is_marked(estimated, reference):
    found = constant_tables({"Optimiser": estimated}, None)["Optimiser"]
    assert found[0].table.heads == ("Sensor", "x", "y", "z") and not found[0].verdict
    assert constants_verdict({"Optimiser": found}) == ""
    silent = dataclasses.replace(estimated, calibration_std={})
    row = constant_tables({"Optimiser": silent}, reference)["Optimiser"][0].table.rows[0]
    assert row.cells[:2] == ("+12.0", "+10.0") and not row.off


def test_filters_of_one_rest_hold_share_their_table(estimated, reference):
    filtered = dataclasses.replace(estimated, method="ekf")
    smoothed = dataclasses.replace(estimated, method="ekf_smoothed")
    tables = constant_tables({"F": filtered, "S": smoothed, "O": estimated}, reference)
    assert list(tables) == ["Rest hold of F and S", "O"]


def test_steps_are_compared_with_the_truth_of_their_own_data(made, reference):
    constants = {"gyroscope_bias/head": np.zeros(3)}
    optimised = dataclasses.replace(made, calibration=constants)
    filtered = dataclasses.replace(optimised, method="ekf")
    both = {"F": filtered, "O": optimised}
    rest, whole = steps_of(both, dict.fromkeys(both, "#000000"), reference)
    assert rest.truth["gyroscope_bias/head"][0] == pytest.approx(0.0145)
    assert whole.truth["gyroscope_bias/head"][0] == pytest.approx(0.0395)


def test_the_page_marks_them(tmp_path, estimated, reference):
    write_report(tmp_path / "page.html", estimated, reference)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert '<td class="off">+24.0 \u00b1 1.0 *</td><td>+20.0</td>' in page
    assert "1 of 3 values beyond 3 standard deviations" in page
    assert "Estimate &plusmn; stated standard deviation, beside the truth" in page

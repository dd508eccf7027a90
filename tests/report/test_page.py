"""The page: what it holds, what it leaves out, and that nothing outside is needed."""

import base64
import dataclasses
import html.parser
import json
import re

import numpy as np
import pytest
from small_person import moved, person, person_xml, recording, setup, solution, swing

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.metrics import evaluate
from mocap_jax.recording import InertialStream, RangeStream, RestHold
from mocap_jax.report import write_report
from mocap_jax.report.statistic_streams import statistic_sources
from mocap_jax.report.uncertainty import cardan_std
from mocap_jax.solution import Status
from mocap_jax.solution.angles import root_relative_angles
from mocap_jax.solution.poses import segment_poses
from mocap_jax.trajectory import Trajectory

STATISTICS = {
    "accelerometer/pelvis": {"rms": 1.02, "count": 600.0},
    "accelerometer/head": {"rms": 1.31, "count": 590.0},
    "gyroscope/head": {"rms": 0.97, "count": 590.0},
    "range/chest-left-head": {"rms": 0.9, "count": 40.0},
    "range/hat-right_forearm": {"rms": 1.7, "count": 12.0},
    "root": {"rms": 1.0, "count": 60.0},
}


class Page(html.parser.HTMLParser):
    """Headings, addresses and tags of a page; checks that tags are closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.addresses: list[str] = []
        self.headings: list[str] = []
        self.tags: set[str] = set()
        self.text_of: dict[str, str] = {}
        self._script = ""
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self._script = dict(attributes).get("id", "") if tag == "script" else ""
        if tag not in ("meta", "img", "br", "link", "input"):
            self.open.append(tag)
        self.addresses += [v for k, v in attributes if k in ("src", "href", "data", "action")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self._script:
            self.text_of[self._script] = self.text_of.get(self._script, "") + data
        if self.open and self.open[-1] in ("h1", "h2", "h3"):
            self.headings.append(data.strip())


@pytest.fixture(scope="module")
def body():
    return person()


@pytest.fixture(scope="module")
def truth(body):
    return swing(body)


@pytest.fixture(scope="module")
def estimates(body, truth):
    """A coarse filter and a finer optimiser, with everything a solution can hold."""
    out = []
    for method, scale, status in (
        ("ekf", 0.08, Status.FILTERED), ("optimise", 0.02, Status.CONVERGED),
    ):  # fmt: skip
        delta = np.random.default_rng(4).normal(0.0, scale, (60, body.nv))
        out.append(
            solution(
                body, Trajectory(truth.time, moved(body, np.asarray(truth.q), delta)),
                status=status, method=method, statistics=STATISTICS,
                covariance=np.repeat(scale**2 * np.eye(body.nv)[None], 60, 0),
                cost=(100.0, 10.0, 1.0) if method == "optimise" else (), iterations=2,
                remarks=("One sensor was silent.",), setup=setup(score_from=0.1),
                calibration={"gyroscope_bias/head": np.array([0.01, 0.0, -0.02])},
                calibration_std={"gyroscope_bias/head": np.full(3, 0.001)},
                options={"tolerance": 1e-6},
            )
        )  # fmt: skip
    return out


def written(path, solutions, reference=None):
    write_report(path, solutions, reference)
    text = path.read_text(encoding="utf-8")
    return text, Page(text)


@pytest.fixture(scope="module")
def reference(truth):
    return dataclasses.replace(recording(truth), salvage=("The last 2 s were cut off.",))


@pytest.fixture(scope="module")
def full(tmp_path_factory, estimates, reference):
    """A page with all sections: its path, text and structure."""
    path = tmp_path_factory.mktemp("page") / "report.html"
    return path, *written(path, estimates, reference)


def test_sections_and_numbers(full, estimates, reference):
    _, text, page = full
    for heading in (
        "a person", "Kalman filter", "Optimiser", "Errors against the truth", "Motion",
        "Joint angles", "Errors by joint", "Is the stated uncertainty honest?",
        "Residuals and innovations", "Distances, by source and receiver", "What each step found",
        "Convergence", "Estimated constants",
    ):  # fmt: skip
        assert heading in page.headings, heading
    for part in (
        Status.FILTERED.value, Status.CONVERGED.value, "One sensor was silent.",
        "The last 2 s were cut off.", "tolerance = 1e-06", "+0.573", "[deg]", "[cm]",
    ):  # fmt: skip
        assert part in text, part
    for estimate in estimates:
        mean = evaluate(estimate, reference)["orientation_error_mean_deg"]["mean_observed"]
        assert f">{mean:.2f}<" in text
    for group in ("Observed joints [deg]", "(table 1) [deg]", "All joints [deg]"):
        assert group in text
    assert "Vlasic et al. 2007 report in" in text


def test_self_contained(full):
    path, text, page = full
    kinds = ("data:image/svg+xml;base64,", "data:image/png;base64,")
    assert page.addresses and all(a.startswith(kinds) for a in page.addresses)
    assert "link" not in page.tags and len(text) < 3e6
    assert not re.search(r"https?://|@import|url\(", text)
    assert [p.name for p in path.parent.iterdir()] == ["report.html"]


def test_player_holds_the_motion(full, estimates, body, truth):
    _, _, page = full
    data = json.loads(page.text_of["player-data"])
    assert [f["name"] for f in data["figures"]] == ["Truth", "Kalman filter", "Optimiser"]
    assert [f["truth"] for f in data["figures"]] == [True, False, False]
    figure = data["figures"][0]
    points = np.frombuffer(base64.b64decode(figure["points"]), "<i2").reshape(
        len(data["time"]), figure["count"], 3
    )
    _, p = segment_poses(body, np.asarray(truth.q)[[0, -1]])
    knee = p[:, body.topology.body_index("LeftLowerLeg")] - p[0, 1] * [1, 1, 0]
    for row, at in ((0, knee[0]), (-1, knee[1])):
        assert np.abs(points[row] / 1000 - at).max(axis=1).min() < 2e-3
    assert all(max(i, j) < figure["count"] for i, j, _ in figure["strokes"])
    assert data["time"][-1] == pytest.approx(float(estimates[1].trajectory.time[-1]), abs=1e-3)


def test_player_shows_the_truth_over_the_last_estimate(full):
    _, text, _ = full
    boxes = re.findall(r'<input type="checkbox" id="player-show-\d"( checked)?>', text)
    assert boxes == [" checked", "", " checked"]
    assert 'id="player-apart"' in text and "The dark outline is the truth" in text


def test_a_method_called_truth_is_no_truth(tmp_path, estimates):
    text, page = written(tmp_path / "named.html", {"Truth": estimates[1]})
    data = json.loads(page.text_of["player-data"])
    assert [f["truth"] for f in data["figures"]] == [False]
    assert "The dark outline is the truth" not in text


def test_smoother_is_not_credited_with_the_filters_innovations(estimates):
    filtered, optimised = estimates
    smoothed = dataclasses.replace(filtered, method="ekf_smoothed", status=Status.SMOOTHED)
    three = {"Kalman filter": filtered, "Kalman smoother": smoothed, "Optimiser": optimised}
    assert list(statistic_sources(three)) == ["Kalman filter: innovations", "Optimiser: residuals"]
    alone = statistic_sources({"Kalman smoother": smoothed})
    assert list(alone) == ["Kalman smoother: forward pass, innovations"]
    silent = dataclasses.replace(filtered, statistics={})
    assert not statistic_sources({"Kalman filter": silent})


def test_confidences_and_suspicions_are_shown(tmp_path, estimates, reference):
    """Ranges with a confidence, and a board whose accelerometer reads in g."""
    n = 400
    ranges = RangeStream(
        np.linspace(0, 5.9, n), np.arange(n) % 2, np.arange(n) % 3, np.full(n, 0.5),
        np.linspace(0, 1, n), ("source/belly", "source/hat"), ("pelvis", "head", "left_thigh"),
    )  # fmt: skip
    up = np.tile([0.0, 0.0, 1.0], (60, 1))
    board = InertialStream(np.arange(60) / 10, up, 0.0 * up, np.full((60, 4), np.nan))
    xml = person_xml().replace('<site name="pelvis"/>', '<site name="pelvis"/><site '
                               'name="source/belly"/><site name="source/hat"/>')  # fmt: skip
    worn = dataclasses.replace(
        reference, ranges=ranges, inertial={"head": board}, body_xml=xml,
        setup=dataclasses.replace(reference.setup, rest=RestHold(0.0, 1.0)),
    )  # fmt: skip
    text, page = written(tmp_path / "worn.html", estimates, worn)
    assert "Confidence of the distances" in page.headings
    assert "Check these sensors" in text and "Sensor head: accelerometer reads in g" in text


def test_cardan_bands_follow_small_turns(body, truth):
    """Stated deviations of hip angles against many drawn poses."""
    random, sigma = np.random.default_rng(2), 0.01
    q = np.asarray(truth.q)[[25]]
    made = solution(body, Trajectory(np.zeros(1), q), covariance=sigma**2 * np.eye(body.nv)[None])
    std = cardan_std(made, "LeftUpperLeg", "Pelvis", np.array([0]))[0]
    draws = moved(body, np.repeat(q, 4000, 0), random.normal(0, sigma, (4000, body.nv)))
    R, _ = segment_poses(body, draws)
    _, angles = root_relative_angles(body, R, "LeftUpperLeg")
    np.testing.assert_allclose(np.std(angles, axis=0), std, rtol=0.08)


def test_without_truth_covariance_ranges(tmp_path, body, truth):
    _, page = written(tmp_path / "bare.html", solution(body, truth))
    assert {"Motion", "Joint angles"} <= set(page.headings)
    absent = {
        "Errors against the truth", "Residuals and innovations", "Convergence",
        "Estimated constants", "Confidence of the distances", "What each step found",
    }  # fmt: skip
    assert not absent & set(page.headings)
    blind = dataclasses.replace(recording(truth), truth=None)
    _, page = written(tmp_path / "blind.html", solution(body, truth), blind)
    assert "Errors against the truth" not in page.headings


def test_failed_solution_is_reported(tmp_path, body, truth, estimates):
    lost = solution(
        body, Trajectory(truth.time, np.full_like(truth.q, np.nan)), status=Status.DIVERGED
    )
    text, page = written(tmp_path / "lost.html", [lost], recording(truth))
    assert Status.DIVERGED.value in text and "Motion" not in page.headings
    text, page = written(tmp_path / "both.html", [estimates[0], lost], recording(truth))
    assert Status.DIVERGED.value in text and "Motion" in page.headings


def test_what_is_not_determined_is_said_beside_the_constants(tmp_path, estimates):
    told = (
        "The recording tells more than the priors about 2 of 3 combinations of constants. "
        "Not determined, the prior stands: gyroscope_bias/head/x."
    )
    stated = dataclasses.replace(estimates[1], remarks=("Another remark.", told))
    text, _ = written(tmp_path / "told.html", [stated])
    assert text.count(told) == 1 and text.count("Another remark.") == 1
    assert text.index("Estimated constants") < text.index(told)


def test_odd_names_are_text(tmp_path, truth, estimates):
    odd = "<script>alert('x')</script> & \"$x_2$\""
    named = dataclasses.replace(
        estimates[1],
        remarks=(odd,),
        statistics={f"accelerometer/{odd}": {"rms": 1.0, "count": 3.0}},
        calibration={f"gyroscope_bias/{odd}": np.zeros(3)},
        calibration_std={},
        options={odd: odd},
        setup=dataclasses.replace(setup(), provenance={"motion": odd}),
    )
    subject = dataclasses.replace(recording(truth), subject=odd, salvage=(odd,))
    text, page = written(tmp_path / "odd.html", {odd: named}, subject)
    # The player's data and code are all scripts there are, and none of it is from a file.
    assert text.count("<script") == 2 and "<script>alert" not in text
    assert page.text_of["player-data"] and json.loads(page.text_of["player-data"])["figures"]
    assert any("alert('x')" in h for h in page.headings)


def test_body_without_known_names(tmp_path):
    """Two segments in a chain without a free joint."""
    body = load_body(
        '<mujoco><worldbody><body name="$upper"><joint name="a" type="ball"/>'
        '<geom size="0.1" mass="1"/><body name="lower_$" pos="0 0 -0.4"><joint name="b"/>'
        '<geom size="0.1" mass="1"/></body></body></worldbody></mujoco>'
    )
    motion = swing(body)
    _, page = written(tmp_path / "rig.html", solution(body, motion))
    assert "Joint angles" in page.headings


def test_several_of_one_method_keep_apart(tmp_path, estimates, truth):
    _, page = written(tmp_path / "two.html", [estimates[0], estimates[0]], recording(truth))
    assert {"Kalman filter", "Kalman filter (2)"} <= set(page.headings)


def test_nothing_is_written_on_failure(tmp_path, estimates):
    with pytest.raises(InputError, match="no solution"):
        write_report(tmp_path / "none.html", [])
    with pytest.raises(InputError, match="cannot write"):
        write_report(tmp_path / "absent" / "report.html", estimates)
    assert not list(tmp_path.iterdir())


def test_truth_of_another_body_is_left_out(tmp_path, body, truth):
    other = dataclasses.replace(
        recording(truth),
        truth=dataclasses.replace(
            recording(truth).truth, body_xml=person_xml().replace('name="Left', 'name="Other')
        ),
    )
    _, page = written(tmp_path / "other.html", solution(body, truth), other)
    assert "Errors against the truth" in page.headings  # the right side is shared

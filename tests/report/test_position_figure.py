"""Hands and feet relative to the pelvis, with bands."""

from __future__ import annotations

import numpy as np
from small_person import moved, person, recording, solution, swing

from mocap_jax.report.position_figure import position_figure
from mocap_jax.report.uncertainty import root_relative_position_std
from mocap_jax.solution.poses import segment_poses
from mocap_jax.trajectory import Trajectory

SIGMA = 0.01


def test_bands_spread_as_draws() -> None:
    """The small person's pelvis: x forward, z up, so forward, up, right are x, z, -y."""
    body = person()
    q = np.asarray(swing(body).q[[25]])
    P = SIGMA**2 * np.eye(body.nv)[None]
    made = solution(body, Trajectory(np.zeros(1), q), covariance=P)
    std = root_relative_position_std(made, ["RightHand"], np.array([0]))[0, 0]
    draws = moved(
        body, np.repeat(q, 4000, 0),
        np.random.default_rng(3).normal(0, SIGMA, (4000, body.nv)),
    )  # fmt: skip
    R, p = segment_poses(body, draws)
    hand = body.topology.body_index("RightHand")
    inside = np.einsum("tij,ti->tj", R[:, 1], p[:, hand] - p[:, 1])
    np.testing.assert_allclose(np.std(inside[:, [0, 2, 1]], axis=0), std, rtol=0.08)


def test_figure_shows_truth_estimate_and_bands() -> None:
    body, truth = person(), swing(person())
    P = np.repeat(SIGMA**2 * np.eye(body.nv)[None], len(truth.time), 0)
    sure, bare = solution(body, truth, covariance=P), solution(body, truth)
    figure = position_figure({"sure": sure, "bare": bare}, {"sure": "C0", "bare": "C1"},
                             recording(truth))  # fmt: skip
    panels = figure.axes
    assert len(panels) == 12
    assert panels[0].get_title(loc="left") == "RightHand: forward [cm]"
    for panel in panels:
        assert [line.get_label() for line in panel.get_lines()] == ["truth", "sure", "bare"]
        assert len(panel.collections) == 1
        same = [np.asarray(line.get_ydata()) for line in panel.get_lines()]
        np.testing.assert_allclose(same[0], same[1], atol=1e-9)
    assert np.ptp(panels[0].get_lines()[0].get_ydata()) > 1.0


def test_a_body_without_ends_has_no_figure() -> None:
    from mocap_jax.body import load_body

    body = load_body('<mujoco><worldbody><body name="A"><joint/><geom size=".1"/></body>'
                     "</worldbody></mujoco>")  # fmt: skip
    path = Trajectory(np.arange(3.0), np.zeros((3, 1)))
    assert position_figure({"a": solution(body, path)}, {"a": "C0"}, None) is None

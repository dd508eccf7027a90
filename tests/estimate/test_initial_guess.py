"""What the optimiser asks of the filter that makes its first guess."""

from __future__ import annotations

import pytest
from joint_samples import sample

import mocap_jax as mj
from mocap_jax.estimate import initial_guess


@pytest.mark.parametrize(
    ("rate", "of_the_filter"), [(None, None), (200.0, 200.0), (60.0, 60.0), (12.0, None)]
)
def test_the_filter_runs_on_the_optimisers_grid_unless_that_is_too_slow_for_it(
    monkeypatch: pytest.MonkeyPatch, rate: float | None, of_the_filter: float | None
) -> None:
    asked: list[mj.EkfOptions] = []
    monkeypatch.setattr(
        initial_guess, "run_ekf", lambda recording, body, options, **_: asked.append(options)
    )
    recording = sample("hinge", seconds=1.5).recording
    options = mj.OptimiseOptions(kinds="AG", root="free", rate_hz=rate)
    body = mj.load_body(recording.body_xml)
    initial_guess.first_guess(recording, body, options, progress=False)
    assert [o.rate_hz for o in asked] == [of_the_filter]
    assert asked[0].kinds == "AG" and asked[0].root == "free" and asked[0].smooth

"""The block on top: simulated or not, how the root's pose was had, the program's version."""

import dataclasses

import jax
import numpy as np
import pytest
from small_person import person, recording, setup, solution, swing

from mocap_jax import __version__
from mocap_jax.body import load_body
from mocap_jax.recording import RootStream
from mocap_jax.report import write_report
from mocap_jax.report.summary import data_sentence, root_sentence, summary_rows

SIMULATED = {"simulated": True, "motion": "walking", "profile": "field", "seed": 7}


@pytest.fixture(scope="module")
def made():
    body = person()
    return solution(body, swing(body), setup=dataclasses.replace(setup(), provenance=SIMULATED))


@pytest.fixture(scope="module")
def reference(made):
    return dataclasses.replace(recording(made.trajectory), setup=made.setup)


def rooted(reference):
    q = np.asarray(reference.truth.trajectory.q)
    time = np.asarray(reference.truth.trajectory.time)
    return dataclasses.replace(reference, root=RootStream(time, q[:, :3], q[:, 3:7]))


def test_simulated_data_are_called_so(made, reference):
    text = data_sentence({"a": made}, reference)
    assert text.startswith("Simulated, not measured on a person: motion walking")
    assert "error profile field (noise, biases" in text and "seed 7" in text
    assert "The true motion is known" in text
    assert "No recording was given" in data_sentence({"a": made}, None)
    stripped = dataclasses.replace(reference, truth=None)
    assert "does not hold the true motion" in data_sentence({"a": made}, stripped)


def test_measured_data_are_not_called_simulated(made, reference):
    plain = dataclasses.replace(reference, setup=setup())
    assert "nothing says that it was simulated" in data_sentence({"a": made}, plain)
    blind = dataclasses.replace(plain, truth=None)
    assert data_sentence({"a": made}, blind).startswith("Not marked as simulated.")


@pytest.mark.parametrize("asked", ["auto", "given"])
def test_given_root(made, reference, asked):
    told = root_sentence(
        {"a": dataclasses.replace(made, options={"root": asked})}, rooted(reference)
    )
    assert told.startswith("Given: a simulated measurement") and "5 mm and 0.57 deg" in told


def test_free_root_and_methods_that_differ(made, reference):
    free = dataclasses.replace(made, options={"root": "free"})
    auto = dataclasses.replace(made, options={"root": "auto"})
    assert root_sentence({"a": free}, rooted(reference)).startswith("Free: found from the worn")
    assert root_sentence({"a": auto}, reference).startswith("Free: the recording has no")
    nothing = jax.tree.map(lambda x: np.full_like(x, np.nan), rooted(reference).root)
    unmeasured = dataclasses.replace(reference, root=nothing)
    assert root_sentence({"a": auto}, unmeasured).startswith("Free: the recording has no")
    told = root_sentence({"a": auto, "b": auto, "c": free}, rooted(reference))
    assert told.startswith("a and b: given: ") and " c: free: " in told
    filtered = dataclasses.replace(auto, statistics={"root": {"rms": 1.0}})
    assert root_sentence({"a": filtered}, None).startswith("Given")
    assert root_sentence({"a": auto}, None).endswith("else free; the recording would tell.")
    silent = dataclasses.replace(made, options={})
    assert root_sentence({"a": silent}, reference) == "Not stated by the solution."


def test_body_without_a_root():
    body = load_body(
        '<mujoco><worldbody><body name="rod"><joint name="a"/><geom size="0.1" mass="1"/></body>'
        "</worldbody></mujoco>"
    )
    assert root_sentence({"a": solution(body, swing(body))}, None).startswith("Fixed")


def test_the_page_shows_the_rows(tmp_path, made, reference):
    rows = dict(summary_rows({"a": made}, reference, "", "Wide."))
    assert list(rows) == ["Data", "Root pose", "Stated uncertainty", "Program"]
    write_report(tmp_path / "page.html", made, reference)
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    for part in (f"mocap_jax {__version__}", "Simulated, not measured", "seed 7", "mean error"):
        assert part in text
    assert text.index("Simulated, not measured") < text.index('class="cards"')

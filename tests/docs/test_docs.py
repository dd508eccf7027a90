"""The Python of README and docs: every page is complete, and runs as it stands.

Those that take minutes are slow tests; that names and arguments exist is told of all of them.
"""

from __future__ import annotations

import ast
import dataclasses
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest
from doc_snippets import PAGES, ROOT, code_of, undefined_names, wrong_uses

import mocap_jax as mj
from mocap_jax.io.two_segment_rig import read_two_segment_rig

WITH_CODE = [page for page in PAGES if code_of(page)]


@pytest.mark.parametrize("page", WITH_CODE, ids=lambda p: p.stem)
def test_names_and_arguments_exist(page: Path):
    tree = ast.parse(code_of(page))
    assert not undefined_names(tree), page.name
    assert not wrong_uses(tree), page.name


def test_what_the_check_finds():
    tree = ast.parse(
        "import mocap_jax as mj\nfrom mocap_jax.body import opensim\n"
        "mj.ekv(recording)\nmj.human(tall=2)\nmj.body.opensim.nothing\nopensim.load_all()\n"
        "mj.Heading()\nmj.human(height=2)\n"
    )
    assert undefined_names(tree) == ["line 3: recording"]
    told = "; ".join(wrong_uses(tree))
    for words in ("line 3: no mj.ekv", "line 4: mj.human: got an unexpected keyword argument",
                  "line 6: no opensim.load_all", "line 7: mj.Heading: missing"):  # fmt: skip
        assert words in told, told
    assert "line 8" not in told


def nothing(folder: Path, data: Callable[[], Path]) -> None:
    """The page needs no files."""


def demo(folder: Path, data: Callable[[], Path]) -> None:
    """The first steps of the bundled recording."""
    (folder / "demo").mkdir()
    whole = mj.read_recording(ROOT / "mocap_jax" / "data" / "demo.mcap")
    part = mj.cut(whole, None, whole.setup.score_from + 1.0)
    mj.write_recording(folder / "demo" / "recording.mcap", part)


def opensense(folder: Path, data: Callable[[], Path]) -> None:
    """OpenSense's example; of the CSV file, what docs/converting.md says its columns are."""
    source = data() / "opensense_walking"
    if not source.is_dir():
        pytest.skip("the recording of OpenSense is absent")
    shutil.copytree(source, folder, dirs_exist_ok=True)
    text = (ROOT / "docs" / "converting.md").read_text(encoding="utf-8")
    start = text.index('format = "csv"\n')
    (folder / "columns.toml").write_text(text[start : text.index("```", start)])
    rows = [f"{10 * i},0,0,-1,{1 + i % 7 / 10},0,0,0,0,0,1,20,0,-40" for i in range(300)]
    head = "t,ax,ay,az,gx,gy,gz,qx,qy,qz,qw,mx,my,mz"
    (folder / "data.csv").write_text("\n".join([head, *rows]) + "\n")


def broad(folder: Path, data: Callable[[], Path]) -> None:
    """One trial of BROAD."""
    source = data() / "broad" / "02_undisturbed_slow_rotation_B.mat"
    if not source.is_file():
        pytest.skip("the trials of BROAD are absent")
    shutil.copy(source, folder)


def rig(folder: Path, data: Callable[[], Path]) -> None:
    """Ten seconds of a trial of the two-segment rig."""
    source = data() / "two_segment_rig" / "data_2D_01.mat"
    if not source.is_file():
        pytest.skip("the trials of the two-segment rig are absent")
    trial = read_two_segment_rig(source, seconds=10.0)
    setup = dataclasses.replace(trial.recording.setup, rest=None)
    recording = dataclasses.replace(trial.recording, setup=setup)
    mj.write_recording(folder / "two_sensors.mcap", recording)


def qmt(folder: Path, data: Callable[[], Path]) -> None:
    """The first steps of qmt's full-body recording, with orientations by VQF."""
    source = data() / "qmt_full_body_16imu" / "full_body_example_data.mat"
    if not source.is_file():
        pytest.skip("the recording of qmt is absent")
    options = mj.ConvertOptions(orientation="vqf")
    whole = mj.convert(source, mapping="qmt_full_body", options=options)
    mj.write_recording(folder / "qmt.mcap", mj.cut(whole, None, 9.0))


SETTINGS = {
    "human": nothing, "cutting": nothing, "gravity_reference": nothing,
    "converting": opensense, "opensim": opensense,
    "README": demo, "uncertainty": demo, "self_calibration": demo, "derivatives": demo,
    "sparse_inertial_poser": nothing, "broad": broad, "mounting": qmt, "full_body_imu": qmt,
    "joints": rig, "anchors": nothing, "absolute_position": nothing,
}  # fmt: skip
SLOW = {
    "README", "uncertainty", "self_calibration", "derivatives", "sparse_inertial_poser", "broad",
    "mounting", "full_body_imu", "joints", "anchors", "absolute_position",
}  # fmt: skip


@pytest.mark.parametrize(
    "page",
    [pytest.param(p, id=p.stem, marks=[pytest.mark.slow] if p.stem in SLOW else [])
     for p in WITH_CODE],
)  # fmt: skip
def test_page_runs(page: Path, request: pytest.FixtureRequest, tmp_path: Path, monkeypatch):
    assert page.stem in SETTINGS, f"say in SETTINGS what {page.name} needs"
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # what conversions tell
        SETTINGS[page.stem](tmp_path, lambda: request.getfixturevalue("shared_data"))
        exec(compile(code_of(page), str(page), "exec"), {"__name__": "__main__"})

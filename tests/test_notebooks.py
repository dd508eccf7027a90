"""The notebooks run from top to bottom, without warnings of ours."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.py"))


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebook_runs(notebook: Path, tmp_path: Path, request: pytest.FixtureRequest):
    environment = {**os.environ, "MPLBACKEND": "agg"}
    if "MOCAP_JAX_DATA" in notebook.read_text(encoding="utf-8"):
        environment["MOCAP_JAX_DATA"] = str(request.getfixturevalue("shared_data").resolve())
    made = tmp_path / f"{notebook.stem}.ipynb"
    for command in (
        ["jupytext", "--to", "ipynb", "--output", str(made), str(notebook)],
        ["pytest", "--nbmake", "--nbmake-timeout=240", "-p", "no:cacheprovider", "-q", str(made)],
    ):
        done = subprocess.run(
            [sys.executable, "-m", *command],
            capture_output=True, text=True, env=environment, cwd=tmp_path, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]

"""The repository as a whole: scripts that run anywhere, files that speak of the project alone."""

from __future__ import annotations

import os
import re
import subprocess
import tomllib
from pathlib import Path

import pytest

from mocap_jax.cli.main import VERBS

ROOT = Path(__file__).resolve().parents[1]
TEXT_SUFFIXES = {"", ".py", ".md", ".toml", ".lock", ".txt", ".ipynb", ".j2", ".html", ".xml"}
# Spelled in parts, so that this file does not contain what it forbids.
REGISTRY_HOSTS = ("pypi" + ".org", "python" + "hosted.org", "conda" + ".anaconda")
MACHINE_PATHS = re.compile(r"(?<![\w.])/(?:work|home|root|Users|opt)" + r"/\w")


def tracked_files() -> list[Path]:
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False, text=True
    )
    if listed.returncode:
        pytest.skip("not a git work tree")
    return [ROOT / name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]


def texts() -> list[tuple[Path, str]]:
    chosen = [f for f in tracked_files() if f.suffix in TEXT_SUFFIXES]
    return [(f, f.read_text(encoding="utf-8", errors="ignore")) for f in chosen]


def test_no_machine_paths():
    found = [f"{f.name}: {m[0]}" for f, text in texts() for m in MACHINE_PATHS.finditer(text)]
    assert not found


def test_no_registry_hosts():
    found = [f"{f.name}: {host}" for f, text in texts() for host in REGISTRY_HOSTS if host in text]
    assert not found


def scripts() -> list[Path]:
    return [f for f in sorted((ROOT / "scripts").iterdir()) if f.is_file() and not f.suffix]


@pytest.mark.parametrize("script", [*scripts(), ROOT / ".ci" / "run"], ids=lambda p: p.name)
def test_script_is_executable_and_says_what_runs_it(script: Path):
    assert os.access(script, os.X_OK)
    assert script.read_text(encoding="utf-8").startswith("#!/usr/bin/env ")


def test_lock_has_hashes_for_every_requirement():
    text = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    entries = [e for e in re.split(r"\n(?=\S)", text) if e and not e.startswith("#")]
    assert len(entries) > 40
    assert all("--hash=sha256:" in entry for entry in entries)


def test_lock_covers_every_dependency():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = project["dependencies"] + project["optional-dependencies"]["dev"]
    names = {re.match(r"[\w.-]+", w)[0].lower().replace("_", "-") for w in wanted}
    locked = set(re.findall(r"^([\w.-]+)==", (ROOT / "requirements.lock").read_text(), re.M))
    assert names <= locked


def test_documents_mention_every_verb():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert not [verb for verb in VERBS if f"mocap-jax {verb}" not in readme]


def test_documents_link_to_files_that_exist():
    missing = []
    for file in [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]:
        for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", file.read_text(encoding="utf-8")):
            if "://" not in target and not (file.parent / target).exists():
                missing.append(f"{file.name}: {target}")
    assert not missing

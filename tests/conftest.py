"""Fixtures shared by all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import mocap_jax  # noqa: F401  (enables 64-bit JAX before anything else)

REPOSITORY = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of other people's recordings, from MOCAP_JAX_DATA; skips when it is absent."""
    folder = Path(os.environ.get("MOCAP_JAX_DATA", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no shared data at {folder} (set MOCAP_JAX_DATA)")
    return folder

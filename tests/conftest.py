"""Fixtures shared by all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import mocap_jax  # noqa: F401  (enables 64-bit JAX before anything else)
from mocap_jax.body import Body, load_body

REPOSITORY = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def nodding_body() -> Body:
    """Two segments, pelvis and trunk, which the standard suit fits."""
    return load_body("""<mujoco>
      <worldbody>
        <body name="Pelvis" pos="0 0 1">
          <freejoint name="root"/>
          <geom type="capsule" size=".1" fromto="0 -.1 0 0 .1 0"/>
          <body name="T8" pos="0 0 .3">
            <joint name="T8" type="ball"/>
            <geom type="capsule" size=".1" fromto="0 -.1 .1 0 .1 .1"/>
          </body>
        </body>
      </worldbody>
    </mujoco>""")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of other people's recordings, from MOCAP_JAX_DATA; skips when it is absent."""
    folder = Path(os.environ.get("MOCAP_JAX_DATA", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no shared data at {folder} (set MOCAP_JAX_DATA)")
    return folder

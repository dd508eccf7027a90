"""What a command loads before it does anything."""

from __future__ import annotations

import subprocess
import sys

SLOW = ("scipy.signal", "scipy.stats", "scipy.optimize", "scipy.interpolate", "pandas", "dask")


def test_estimators_come_without_libraries_that_are_slow_to_load():
    code = "import mocap_jax.estimate, sys; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=120
    )
    loaded = set(done.stdout.split())
    assert "mocap_jax.estimate" in loaded
    assert not loaded & set(SLOW)

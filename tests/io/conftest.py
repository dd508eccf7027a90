"""Make `io_samples` importable by name; the body that its samples are of."""

import sys
from pathlib import Path

import pytest

from mocap_jax.body import Body, load_body

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def body() -> Body:
    from io_samples import XML

    return load_body(XML)

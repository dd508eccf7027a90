"""Run the Python scripts in the repository's own environment, making it if need be."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def enter() -> None:
    """Continue this script in `.venv`; returns at once when it already runs there.

    Call it before any import that is not of the standard library.
    """
    environment = ROOT / ".venv"
    if Path(sys.prefix).resolve() == environment.resolve():
        return
    made = subprocess.run([str(ROOT / "scripts" / "setup-environment")], check=False)
    if made.returncode:
        sys.exit(made.returncode)
    python = str(environment / "bin" / "python")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.execv(python, [python, *sys.argv])

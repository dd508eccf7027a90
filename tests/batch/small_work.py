"""Work that worker processes can load: writes the solution, fails where the recording says so."""

from __future__ import annotations

import os
from pathlib import Path

from mocap_jax.errors import InputError


def copy_work(source: Path, target: Path) -> dict:
    text = source.read_text()
    if text == "wrong":
        raise InputError(f"{source}: is wrong")
    if text == "odd":
        raise ZeroDivisionError("by zero")
    if text == "deadly":
        os._exit(9)
    target.write_text(text)
    bad = {"failed": "Failed: non-finite."} if text == "failed" else {}
    salvage = ["the file ends early"] if text == "damaged" else []
    errors = {"orientation_error_mean_deg": {"mean": 3.0, "mean_observed": 2.0}}
    return {
        "status": f"Copied {text}.", "frames": len(text), "errors": errors, "salvage": salvage,
        "process": os.getpid(), **bad,
    }  # fmt: skip

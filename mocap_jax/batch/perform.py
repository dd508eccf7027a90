"""One job done, whatever comes of it: its record is written beside its solution."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mocap_jax.batch.jobs import Job
from mocap_jax.errors import MocapError

Work = Callable[[Path, Path], dict[str, Any]]
"""Makes the solution (second path) of a recording (first) and returns its results as JSON. It must
be a function of a module, or `functools.partial` of one, so that worker processes can load it. A
result with the key `failed` (a sentence) is one that must not be used."""


def perform(work: Work, job: Job) -> dict[str, Any]:
    """Do a job and record what came of it; an error is a record, too."""
    begin = time.perf_counter()
    try:
        results = work(job.source, job.solution)
    except Exception as error:
        results = {"failed": describe_failure(error)}
    record = {
        "source": str(job.source),
        "solution": None if results.get("failed") else str(job.solution),
        "fingerprint": job.fingerprint,
        "failed": None,
        **results,
        "seconds": time.perf_counter() - begin,
    }
    part = job.record.with_name(f".{job.record.name}.{os.getpid()}.part")
    try:
        part.write_text(json.dumps(record, indent=2, allow_nan=False) + "\n", encoding="utf-8")
        part.replace(job.record)
    finally:
        part.unlink(missing_ok=True)
    return record


def describe_failure(error: BaseException) -> str:
    """One line about an error."""
    text = " ".join(str(error).split())[:400]
    return text if isinstance(error, MocapError) else f"{type(error).__name__}: {text}"

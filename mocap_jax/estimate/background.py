"""Programs compiled one after the other in a thread of their own, while the caller works."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor

from mocap_jax.estimate import compile_clock

_worker = ThreadPoolExecutor(1, thread_name_prefix="compile")


def compile_later(job: Callable[[], object]) -> Future[None]:
    """Queue a job that compiles something.

    Whatever fails in it fails again, and is reported, where its result is wanted.
    """

    def run() -> None:
        with contextlib.suppress(Exception):
            job()

    return _worker.submit(run)


def wait_for(jobs: Sequence[Future[None]]) -> None:
    """Return when jobs are done; the time counts as compilation."""
    begin = time.perf_counter()
    for job in jobs:
        job.result()
    compile_clock.add(time.perf_counter() - begin)

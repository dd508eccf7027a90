"""Programs compiled one after the other in a thread of their own, while the caller works."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait

from mocap_jax.estimate import compile_clock


def _new_worker() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(1, thread_name_prefix="compile")


_workers = [_new_worker()]
_seen: set[object] = set()


def _after_fork() -> None:
    # A forked process has the executor but not its thread.
    _workers[0] = _new_worker()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


def compile_once(key: object, *jobs: Callable[[], object]) -> list[Future[None]]:
    """Queue jobs that compile programs, one after the other; none if the key was seen before.

    Whatever fails in a job fails again, and is reported, where its result is wanted.
    """

    def run(job: Callable[[], object]) -> None:
        with contextlib.suppress(Exception):
            job()

    if key in _seen:
        return []
    _seen.add(key)
    return [_workers[0].submit(run, job) for job in jobs]


def wait_for(jobs: Sequence[Future[None]]) -> None:
    """Return when jobs are done; the time counts as compilation."""
    begin = time.perf_counter()
    wait(jobs)
    compile_clock.add(time.perf_counter() - begin)

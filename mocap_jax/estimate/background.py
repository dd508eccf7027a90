"""Programs compiled one after the other in a thread of their own, while the caller works."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future

from mocap_jax.estimate import compile_clock

# Between looks at whether a job is done [s].
_PAUSE = 0.005


class _Queue:
    """Jobs done one after the other, by a thread that lives as long as there are any.

    The interpreter waits for the thread before it exits: a daemon that comes back from the compiler
    after that would end inside it. So a program under way is compiled to its end, but once the main
    thread is gone no other is begun.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._jobs: deque[tuple[Future[None], Callable[[], object]]] = deque()
        self._working = False

    def submit(self, job: Callable[[], object]) -> Future[None]:
        """Append a job; whatever fails in it is not told."""
        future: Future[None] = Future()
        with self._lock:
            self._jobs.append((future, job))
            if not self._working:
                threading.Thread(target=self._work, name="compile").start()
                self._working = True
        return future

    def _work(self) -> None:
        while (taken := self._next()) is not None:
            future, job = taken
            if future.set_running_or_notify_cancel():
                with contextlib.suppress(Exception):
                    job()
                future.set_result(None)

    def _next(self) -> tuple[Future[None], Callable[[], object]] | None:
        with self._lock:
            while self._jobs:
                future, job = self._jobs.popleft()
                if threading.main_thread().is_alive():
                    return future, job
                future.cancel()
                future.set_running_or_notify_cancel()  # tells those who wait
            self._working = False
            return None


_queues = [_Queue()]
_seen: set[object] = set()


def _after_fork() -> None:
    # A forked process has the queue but not its thread.
    _queues[0] = _Queue()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


def compile_once(key: object, *jobs: Callable[[], object]) -> list[Future[None]]:
    """Queue jobs that compile programs, one after the other; none if the key was seen before.

    Whatever fails in a job fails again, and is reported, where its result is wanted. Jobs that wait
    when the interpreter exits are cancelled.
    """
    if key in _seen:
        return []
    _seen.add(key)
    return [_queues[0].submit(job) for job in jobs]


def wait_for(jobs: Sequence[Future[None]]) -> None:
    """Return when jobs are done; the time counts as compilation."""
    begin = time.perf_counter()
    # `concurrent.futures.wait` takes the locks of all jobs; interrupted there, it keeps some, and
    # the thread that would finish a job waits for them for ever.
    while not all(job.done() for job in jobs):
        time.sleep(_PAUSE)
    compile_clock.add(time.perf_counter() - begin)

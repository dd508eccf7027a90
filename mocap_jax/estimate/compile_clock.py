"""How long JAX spent tracing and compiling, so that run time can be told apart from it.

Each thread counts its own: what another compiles meanwhile costs this one no time.
"""

from __future__ import annotations

import threading

import jax


class _Total(threading.local):
    seconds: float = 0.0


_total = _Total()
_PREFIX = "/jax/core/compile/"


def _count(event: str, duration: float, **_: object) -> None:
    if event.startswith(_PREFIX):
        add(duration)


def add(seconds: float) -> None:
    """Count time that this thread waited for compilation."""
    _total.seconds += seconds


jax.monitoring.register_event_duration_secs_listener(_count)


class CompileClock:
    """Context manager; `seconds` is the time spent on compilation inside it."""

    seconds: float = 0.0

    def __enter__(self) -> CompileClock:
        self._before = _total.seconds
        return self

    def __exit__(self, *exception: object) -> None:
        self.seconds += _total.seconds - self._before

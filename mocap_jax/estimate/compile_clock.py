"""How long JAX spent tracing and compiling, so that run time can be told apart from it."""

from __future__ import annotations

import jax

_total = [0.0]
_PREFIX = "/jax/core/compile/"


def _count(event: str, duration: float, **_: object) -> None:
    if event.startswith(_PREFIX):
        _total[0] += duration


jax.monitoring.register_event_duration_secs_listener(_count)


class CompileClock:
    """Context manager; `seconds` is the time spent on compilation inside it."""

    seconds: float = 0.0

    def __enter__(self) -> CompileClock:
        self._before = _total[0]
        return self

    def __exit__(self, *exception: object) -> None:
        self.seconds += _total[0] - self._before

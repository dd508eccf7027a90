"""One short line a step of long work, for logs and pipes, where progress bars are off."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO


def is_watched() -> bool:
    """Whether a person sees both streams, so that progress bars (on stderr) are enough."""
    return sys.stdout.isatty() and sys.stderr.isatty()


class StepLines:
    """Prints `2/6 filter ... 14 s` a step: the name when it begins, the time when it is done.

    Args:
        total: number of steps.
        shown: print at all; default where nobody watches progress bars.
        stream: default stdout.
    """

    def __init__(self, total: int, *, shown: bool | None = None, stream: TextIO | None = None):
        self._total, self._number = total, 0
        self._shown = not is_watched() if shown is None else shown
        self._stream = sys.stdout if stream is None else stream

    @contextmanager
    def step(self, what: str) -> Iterator[None]:
        """Run one step."""
        self._number += 1
        self._print(f"{self._number}/{self._total} {what} ...", end="")
        start = time.monotonic()
        try:
            yield
        except BaseException:
            self._print("")  # what is said of the failure stands on a line of its own
            raise
        self._print(f" {time.monotonic() - start:.0f} s")

    def _print(self, text: str, end: str = "\n") -> None:
        if self._shown:
            print(text, end=end, file=self._stream, flush=True)

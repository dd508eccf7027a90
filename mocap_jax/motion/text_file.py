"""Lines of a text file that know where they stand, for error messages."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from mocap_jax.errors import InputError


@dataclass(frozen=True)
class LineReader:
    """A line that is neither empty nor a comment."""

    path: Path
    number: int
    """Counted from 1."""
    text: str

    @cached_property
    def words(self) -> list[str]:
        """The line split at white space."""
        return self.text.split()

    def error(self, fault: str) -> InputError:
        """Error that names the file and this line."""
        return InputError(f"{self.path}: line {self.number}: {fault}")

    def floats(self, first: int, count: int) -> np.ndarray:
        """The `count` numbers that start at word `first`."""
        words = self.words[first : first + count]
        if len(words) < count:
            raise self.error(f"expected {count} numbers, found {len(words)}")
        return self.numbers(words)

    def numbers(self, words: list[str]) -> np.ndarray:
        """Words of this line as finite numbers."""
        for word in words:
            try:
                finite = np.isfinite(float(word))
            except ValueError:
                raise self.error(f"'{word}' is not a number") from None
            if not finite:
                raise self.error(f"'{word}' is not finite")
        return np.array(words, float)


def read_text(path: Path) -> str:
    """Whole text of a file that exists and is not empty."""
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        text = path.read_text(encoding="utf-8", errors="strict")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file") from error
    if not text.strip():
        raise InputError(f"{path}: the file is empty")
    return text


def read_lines(path: Path) -> list[LineReader]:
    """All lines but empty ones and comments (from `#`)."""
    lines = [
        LineReader(path, number, bare)
        for number, line in enumerate(read_text(path).splitlines(), start=1)
        if (bare := line.split("#", 1)[0].strip())
    ]
    if not lines:
        raise InputError(f"{path}: the file holds nothing but comments")
    return lines

"""Tables of numbers in text files: named columns, one clear error, truncated ends salvaged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from mocap_jax.errors import InputError, unknown_name

_MISSING = ("", "nan", "NaN", "NA", "null", "-")


@dataclass(frozen=True)
class TextTable:
    """A header and rows of words; columns become numbers when they are asked for."""

    path: Path
    names: tuple[str, ...]
    rows: list[list[str]]
    first_line: int
    """Line number of the first row, counted from 1."""
    comments: tuple[str, ...] = ()
    salvage: tuple[str, ...] = ()

    def has(self, *names: str) -> bool:
        """Whether all these columns exist and hold at least one value."""
        return all(n in self.names for n in names) and all(
            any(row[self.names.index(n)] not in _MISSING for row in self.rows) for n in names
        )

    def column(self, name: str) -> Float[np.ndarray, "n"]:
        """One column; NaN where a cell is empty.

        Raises:
            InputError: no such column, or a cell that is not a number (file, line and column
                are named).
        """
        if name not in self.names:
            raise InputError(f"{self.path}: {unknown_name('column', name, self.names)}")
        at = self.names.index(name)
        words = ["nan" if row[at] in _MISSING else row[at] for row in self.rows]
        try:
            return np.array(words, dtype=float)
        except ValueError:
            for number, word in enumerate(words, start=self.first_line):
                try:
                    float(word)
                except ValueError:
                    raise InputError(
                        f"{self.path}: line {number}, column '{name}': '{word}' is not a number"
                    ) from None
            raise

    def columns(self, names: Sequence[str]) -> Float[np.ndarray, "n k"]:
        """Several columns side by side."""
        return np.stack([self.column(n) for n in names], axis=1)


def read_table(
    path: Path,
    *,
    comment: str = "#",
    delimiter: str | None = None,
    header: str | None = None,
    named: bool = True,
) -> TextTable:
    """Read a table whose first line that is no comment names the columns.

    Args:
        path: text file.
        comment: what lines before and between rows begin with that are no data.
        delimiter: between cells; None finds out from the header (tab, semicolon, comma).
        header: a column that the header line must name; lines before it count as comments.
        named: whether there is such a line; columns are called "1", "2", ... without, as many as
            the longest row has.

    Raises:
        InputError: missing, empty or binary file, no header, rows of different lengths (other
            than a truncated last one, which is left out and said in `salvage`).
    """
    lines = _lines(path)
    at, comments = _header_line(path, lines, comment, header)
    text = lines[at]
    cut = delimiter or next((d for d in "\t;," if d in text), None)
    if not named:
        at -= 1
    names = tuple(_cells(text, cut)) if named else ()
    if len(set(names)) < len(names):
        if holds_numbers(names):
            raise unnamed(path)
        twice = next(n for n in names if names.count(n) > 1)
        raise InputError(f"{path}: line {at + 1}: column '{twice}' is there twice")
    body = [
        (number, line)
        for number, line in enumerate(lines[at + 1 :], start=at + 2)
        if line.strip() and not (comment and line.startswith(comment))
    ]
    says = f"the header names {len(names)}"
    if not named:
        names, says = _numbered(body, cut)
    rows, lost = _rows(path, len(names), says, body, cut)
    if not rows:
        raise InputError(f"{path}: no rows of data after the header (line {at + 1})")
    return TextTable(path, names, rows, body[0][0], comments, lost)


def holds_numbers(names: Sequence[str]) -> bool:
    """Whether a header is none, but a row of numbers."""
    try:
        return bool(names) and all(np.isfinite(float(name)) for name in names)
    except ValueError:
        return False


def unnamed(path: Path) -> InputError:
    """The error for a table whose columns have no names."""
    return InputError(
        f"{path}: the first line holds numbers, no names of columns; if there are none, write "
        "header = false in the mapping (csv) and number the columns from 1"
    )


def _lines(path: Path) -> list[str]:
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        try:
            text = path.read_text(encoding="latin-1")
        except UnicodeDecodeError:
            raise InputError(f"{path}: not a text file") from error
        if "\x00" in text:
            raise InputError(f"{path}: not a text file") from error
    if not text.strip():
        raise InputError(f"{path}: the file is empty")
    return text.splitlines()


def _header_line(
    path: Path, lines: list[str], comment: str, header: str | None
) -> tuple[int, tuple[str, ...]]:
    comments = []
    for at, line in enumerate(lines):
        if not line.strip() or (comment and line.startswith(comment)):
            comments.append(line.removeprefix(comment).strip())
        elif header is None or header in line:
            return at, tuple(comments)
        else:
            comments.append(line.strip())
    wanted = f" that names '{header}'" if header else ""
    raise InputError(f"{path}: no header line{wanted}")


def _cells(line: str, delimiter: str | None) -> list[str]:
    cells = [c.strip().strip('"') for c in line.split(delimiter)]
    while len(cells) > 1 and not cells[-1] and delimiter is not None:
        cells.pop()  # a delimiter at the end of the line
    return cells


def _numbered(body: list[tuple[int, str]], delimiter: str | None) -> tuple[tuple[str, ...], str]:
    """Numbers for the columns of the longest row, and where it is, for messages."""
    # Not the first row: its last cells may be empty.
    width, negative = max((len(_cells(line, delimiter)), -number) for number, line in body)
    return tuple(str(i + 1) for i in range(width)), f"line {-negative} has {width}"


def _rows(
    path: Path, width: int, says: str, body: list[tuple[int, str]], delimiter: str | None
) -> tuple[list[list[str]], tuple[str, ...]]:
    rows: list[list[str]] = []
    for at, (number, line) in enumerate(body):
        cells = [c.strip().strip('"') for c in line.split(delimiter)]
        if len(cells) > width and not any(cells[width:]):
            cells = cells[:width]
        if len(cells) == width:
            rows.append(cells)
        elif at == len(body) - 1 and len(cells) < width and rows:
            return rows, (f"{path.name}: the last line ({number}) is truncated and left out.",)
        else:
            raise InputError(f"{path}: line {number} has {len(cells)} cells, {says}")
    return rows, ()

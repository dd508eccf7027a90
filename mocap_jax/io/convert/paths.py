"""Files and folders that make up one recording of another system."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

from mocap_jax.errors import InputError

_Item = TypeVar("_Item")


def files_of(paths: Sequence[Path], suffixes: tuple[str, ...]) -> list[Path]:
    """Files among the paths and directly in those that are folders, by suffix, sorted."""
    out: list[Path] = []
    for path in paths:
        found = sorted(path.iterdir()) if path.is_dir() else [path]
        out += [f for f in found if f.is_file() and f.suffix.lower() in suffixes]
    return list(dict.fromkeys(out))


def one_file(paths: Sequence[Path], suffixes: tuple[str, ...], what: str) -> Path:
    """The only such file.

    Raises:
        InputError: none, or several (they are named).
    """
    files = files_of(paths, suffixes)
    if not files:
        raise InputError(f"{paths[0]}: no {what} there (suffix {', '.join(suffixes)})")
    if len(files) > 1:
        names = ", ".join(f.name for f in files[:8])
        raise InputError(f"{paths[0]}: {len(files)} such files ({names}); name one {what}")
    return files[0]


def over(items: Iterable[_Item], progress: bool) -> Iterator[_Item]:
    """The items, with a progress bar on stderr if wanted."""
    from tqdm import tqdm

    yield from tqdm(list(items), desc="reading", unit="file", disable=not progress, leave=False)

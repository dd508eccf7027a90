"""Exit codes of the command line, and the error that means wrong usage."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from mocap_jax.errors import InputError, unknown_name

SUCCESS = 0
FAILURE = 1
USAGE = 2
SALVAGED = 3
"""The result can be used, but its input was damaged and something was lost."""


class UsageError(InputError):
    """An argument of the command line is wrong."""


def unknown_choice(option: str, what: str, name: str, valid: Iterable[str]) -> UsageError:
    """Make the error for a value of an option ("--profile") that is not among the valid ones."""
    return UsageError(f"{option}: {unknown_name(what, name, valid)}")


@contextmanager
def value_of(option: str) -> Iterator[None]:
    """Turn input errors of what an option's value is made into (never a file) into wrong usage."""
    try:
        yield
    except InputError as error:
        raise UsageError(f"{option}: {error}") from error

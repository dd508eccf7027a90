"""Errors that reach the user, and the hints that make them useful."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class MocapError(Exception):
    """Base of every error this package raises on purpose; its text is one line."""


class InputError(MocapError):
    """A file or an argument is wrong; the text names it, the fault and the valid choices."""


class SolveError(MocapError):
    """An estimate could not be computed (raised only when `throw=True`)."""


def unknown_name(what: str, name: str, valid: Iterable[str]) -> InputError:
    """Make the error for a name that is not among the valid ones.

    Args:
        what: kind of thing that was named, as the user would call it ("site", "sensor").
        name: the name that was given.
        valid: the names that exist; the closest ones are listed first.
    """
    names = list(valid)
    close = difflib.get_close_matches(name, names, n=3, cutoff=0.6)
    ordered = close + [n for n in names if n not in close]
    shown = ", ".join(ordered[:24]) + (f", ... ({len(names)} in all)" if len(names) > 24 else "")
    return InputError(f"unknown {what} '{name}'; valid: {shown or '(none)'}")

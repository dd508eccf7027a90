"""Exit codes of the command line, and the error that means wrong usage."""

from __future__ import annotations

from mocap_jax.errors import InputError

SUCCESS = 0
FAILURE = 1
USAGE = 2
SALVAGED = 3
"""The result can be used, but its input was damaged and something was lost."""


class UsageError(InputError):
    """An argument of the command line is wrong."""

"""Types of arguments that are lists of names."""

from __future__ import annotations

import argparse
from collections.abc import Callable


def one_of(valid: tuple[str, ...]) -> Callable[[str], list[str]]:
    """Type of a list of names, in the order of `valid`."""

    def names(value: str) -> list[str]:
        chosen = value.split(",")
        for name in chosen:
            if name not in valid:
                raise argparse.ArgumentTypeError(f"'{name}'; valid: {', '.join(valid)}")
        return [name for name in valid if name in chosen]

    return names

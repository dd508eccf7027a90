"""One cell is one estimate: motion, profile, seed, sensors and method. Cells are kept as files."""

from __future__ import annotations

import ast
import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

METHODS = {
    "ekf_paper": "EKF, paper's Q",
    "ekf": "EKF, tuned",
    "smoothed": "EKF, smoothed",
    "optimise": "optimiser",
}
"""Methods and how the tables call them."""

CHAINS = {"direct": "", "wired": ", wired", "raw": ", from waveforms"}
"""How measurements come about, see `chain`, and what the tables add to the profile's name."""

_PACKAGE = Path(__file__).resolve().parents[2] / "mocap_jax"
# Rooms and files that no figure depends on; and those that only the optimiser's depend on.
_WITHOUT_EFFECT = ("cli", "report", "io", "data")
_OPTIMISER_ONLY = (
    "linalg", "least_squares", "residuals", "estimate/sequence", "estimate/whole_sequence",
    "estimate/initial_guess", "estimate/check_residual",
)  # fmt: skip


_OWN = (Path(__file__).with_name("scores.py"),)


@dataclass(frozen=True)
class Cell:
    """What identifies one estimate."""

    motion: str
    """A built-in motion, or the path of a motion file."""
    profile: str
    seed: int
    combination: str
    method: str
    cut: float | None
    """Only the first seconds of the motion were used; None for all."""
    chain: str = "direct"
    """One of `CHAINS`."""

    @property
    def kinds(self) -> str:
        """The letters that `EkfOptions.kinds` takes."""
        return self.combination.replace("+", "")

    @property
    def label(self) -> str:
        """The motion as tables call it."""
        return Path(self.motion).stem

    @property
    def condition(self) -> str:
        """Profile and chain as tables call them."""
        return self.profile + CHAINS[self.chain]

    @property
    def file(self) -> str:
        """Where a cell made by the present code is kept, see `Store`."""
        length = "whole" if self.cut is None else f"{self.cut:g}s"
        name = f"{self.combination}-{self.method}-{self.seed}-{code_version(self.method)}.json"
        folder = self.profile if self.chain == "direct" else f"{self.profile}-{self.chain}"
        return f"{self.label}-{length}/{folder}/{name}"


@cache
def code_version(method: str, scripts: tuple[Path, ...] = _OWN) -> str:
    """Short hash of the code behind a method's figures; comments and docstrings do not count.

    Args:
        method: one of `METHODS`.
        scripts: files outside the package that figures depend on as well.
    """
    left_out = _WITHOUT_EFFECT + (() if method == "optimise" else _OPTIMISER_ONLY)
    total = hashlib.sha256()
    for file in [*sorted(_PACKAGE.rglob("*.py")), *scripts]:
        inside = file.relative_to(_PACKAGE).as_posix() if _PACKAGE in file.parents else file.name
        if not inside.startswith(left_out):
            total.update(inside.encode() + _code_of(file))
    return total.hexdigest()[:10]


def _code_of(file: Path) -> bytes:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):  # Strings that stand alone are docstrings.
            node.body = [s for s in body if not _is_text(s)]  # type: ignore[attr-defined]
    return ast.dump(tree).encode()


def _is_text(statement: ast.AST) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )

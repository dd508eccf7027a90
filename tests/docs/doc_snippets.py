"""The Python blocks of the documentation, and what can be told of them without running them."""

from __future__ import annotations

import ast
import builtins
import importlib
import inspect
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def code_of(page: Path) -> str:
    """All Python blocks of a page, as one program; lines are those of the page."""
    text = page.read_text(encoding="utf-8")
    out, line = "", 1
    for found in _BLOCK.finditer(text):
        first = text[: found.start(1)].count("\n") + 1
        out += "\n" * (first - line) + found[1]
        line = first + found[1].count("\n")
    return out


def undefined_names(tree: ast.Module) -> list[str]:
    """Names that are read and that nothing in the page binds."""
    bound = set(dir(builtins))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            bound |= {(a.asname or a.name).split(".")[0] for a in node.names}
        elif isinstance(node, ast.FunctionDef):
            bound |= {node.name, *(a.arg for a in node.args.args)}
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            bound.add(node.id)
    read = [n for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)]
    return [f"line {n.lineno}: {n.id}" for n in read if n.id not in bound]


def wrong_uses(tree: ast.Module) -> list[str]:
    """Public names of the package that do not exist, and arguments that its functions lack."""
    known = imported(tree)
    wrong = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and _found(node.value, known) is not None:
            if _found(node, known) is None:
                wrong.append(f"line {node.lineno}: no {ast.unparse(node)}")
        elif isinstance(node, ast.Call) and callable(target := _found(node.func, known)):
            wrong += _wrong_arguments(node, target)
    return wrong


def imported(tree: ast.Module) -> dict[str, Any]:
    """What the page imports from the package, by the name it has there."""
    known: dict[str, Any] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for a in node.names:
                if a.name.split(".")[0] == "mocap_jax":
                    known[a.asname or a.name] = importlib.import_module(a.name)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("mocap_jax"):
            home = importlib.import_module(str(node.module))
            for a in node.names:
                known[a.asname or a.name] = _member(home, a.name)
    return known


def _member(home: Any, name: str) -> Any:
    if hasattr(home, name):
        return getattr(home, name)
    return importlib.import_module(f"{home.__name__}.{name}")


def _found(node: ast.expr, known: dict[str, Any]) -> Any:
    """The object that a dotted name of the package means; None for anything else."""
    if isinstance(node, ast.Name):
        return known.get(node.id)
    if isinstance(node, ast.Attribute):
        home = _found(node.value, known)
        return None if home is None else getattr(home, node.attr, None)
    return None


def _wrong_arguments(call: ast.Call, target: Any) -> list[str]:
    try:
        signature = inspect.signature(target)
    except (TypeError, ValueError):
        return []
    named = {k.arg: None for k in call.keywords if k.arg}
    try:
        signature.bind(*[None] * len(call.args), **named)
    except TypeError as error:
        return [f"line {call.lineno}: {ast.unparse(call.func)}: {error}"]
    return []

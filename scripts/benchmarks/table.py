"""Metrics as lines of text, beside the committed figures."""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.metric import Metric

BASELINE = Path(__file__).with_name("baseline.json")


def baseline() -> dict[str, float]:
    """Committed value of each metric."""
    if not BASELINE.exists():
        return {}
    return {row["name"]: row["value"] for row in json.loads(BASELINE.read_text("utf-8"))}


def heading() -> str:
    """Column titles."""
    return (
        f"{'metric':32s} {'value':>9s} {'unit':6s} {'better':7s} {'target':>7s} {'met':4s} "
        f"{'baseline':>9s}  measured on"
    )


def line(metric: Metric, committed: dict[str, float]) -> str:
    """One metric."""
    before = committed.get(metric.name)
    shown = "-" if before is None else f"{before:.3g}"
    context = ", ".join(f"{k} {_text(v)}" for k, v in metric.context.items())
    return (
        f"{metric.name:32s} {metric.value:9.3g} {metric.unit:6s} {metric.better:7s} "
        f"{metric.target:7g} {'yes' if metric.met else 'NO':4s} {shown:>9s}  {context}"
    )


def _text(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)

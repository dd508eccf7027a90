"""The measures as text."""

from __future__ import annotations


def rows(title: str, by_estimate: dict[str, dict]) -> str:
    """One line a measure, a column an estimate."""
    keys = list(dict.fromkeys(k for values in by_estimate.values() for k in values))
    width = max(len(k) for k in keys)
    lines = [f"{title:{width}s} " + " ".join(f"{name[-14:]:>14s}" for name in by_estimate)]
    for key in keys:
        cells = [values.get(key) for values in by_estimate.values()]
        lines.append(
            f"{key:{width}s} "
            + " ".join(f"{'' if c is None else format(c, 'g'):>14s}" for c in cells)
        )
    return "\n".join(lines)


def residuals(by_estimate: dict[str, dict[str, dict[str, float]]]) -> str:
    """Accelerations and rates per sensor, an estimate beside the other."""
    short = {"accelerometer": "m/s^2", "gyroscope": "deg/s", "orientation": "deg"}
    flat = {
        name: {
            f"{sensor} [{short[kind]}]": value
            for sensor, kinds in values.items() for kind, value in kinds.items()
        }
        for name, values in by_estimate.items()
    }  # fmt: skip
    return rows("residuals (RMS)", flat)


def plausibility(values: dict[str, dict[str, float]]) -> str:
    """Every joint angle of one estimate."""
    lines = [f"{'joint angle':46s} {'within':>8s} {'1 % .. 99 %':>16s} {'published':>14s} [deg]"]
    for name, row in values.items():
        span = f"{row['percentile_1_deg']:.0f} .. {row['percentile_99_deg']:.0f}"
        lines.append(
            f"{name:46s} {row['within_percent']:6.1f} % {span:>16s} "
            f"{row['low_deg']:6.0f} .. {row['high_deg']:.0f}"
        )
    return "\n".join(lines)

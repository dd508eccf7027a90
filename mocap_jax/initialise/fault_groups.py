"""The same fault of several sensors, said once."""

from __future__ import annotations

import re

# Numbers that stand by themselves: not the 2 of m/s^2, not those of names.
_NUMBER = re.compile(r"(?<![\w.^/-])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w^])")


def grouped_faults(faults: dict[str, tuple[str, ...]]) -> tuple[str, ...]:
    """One sentence a fault, with all sensors that have it; where numbers differ, their range.

    Args:
        faults: sensor -> what is wrong with it.
    """
    groups: dict[str, list[tuple[str, str]]] = {}
    for sensor, texts in faults.items():
        for text in texts:
            groups.setdefault(_NUMBER.sub("#", text), []).append((sensor, text))
    lines = []
    for members in groups.values():
        names = [name for name, _ in members]
        merged = _merged([text for _, text in members])
        lines.append(f"Sensor{'s' * (len(names) > 1)} {', '.join(names)}: {merged}.")
    return tuple(lines)


def _merged(texts: list[str]) -> str:
    """Texts that differ in numbers as one, with the range of each number."""
    columns = iter(zip(*(_NUMBER.findall(text) for text in texts), strict=True))

    def one(_: re.Match[str]) -> str:
        found = sorted(next(columns), key=float)
        return found[0] if float(found[0]) == float(found[-1]) else f"{found[0]} to {found[-1]}"

    return _NUMBER.sub(one, texts[0])

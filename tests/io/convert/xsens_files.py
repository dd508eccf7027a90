"""Files of the layout of Xsens MT exports."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from known_motion import Known

MATRIX = [f"Mat[{r}][{c}]" for c in (1, 2, 3) for r in (1, 2, 3)]
QUATERNION = [f"Quat_q{i}" for i in range(4)]


def write(
    folder: Path,
    motion: Known,
    serial: str = "00B4AAAA",
    *,
    counters: np.ndarray | None = None,
    columns: tuple[str, ...] = ("Acc", "Gyr", "Mag", "Quat"),
    rate: str | None = "100.0Hz",
    trial: str = "MT_01-000",
) -> Path:
    n = len(motion.time)
    counters = np.arange(472, 472 + n) % 65536 if counters is None else counters
    names, parts = ["PacketCounter", "SampleTimeFine"], []
    for what, values in (("Acc", motion.force), ("Gyr", motion.rate), ("Mag", motion.field / 5e-5)):
        if what in columns:
            names += [f"{what}_{axis}" for axis in "XYZ"]
            parts.append(values)
    if "Quat" in columns:
        names += QUATERNION
        parts.append(motion.orientation)
    if "Mat" in columns:
        names += MATRIX
        parts.append(motion.matrices.transpose(0, 2, 1).reshape(n, 9))
    rows = np.hstack(parts)
    lines = ["// Start Time: Unknown"]
    if rate is not None:
        lines.append(f"// Update Rate: {rate}")
    lines.append("\t".join(names))
    for counter, row in zip(counters, rows, strict=True):
        lines.append("\t".join([f"{counter:05d}", "", *(f"{x:.9f}" for x in row)]))
    file = folder / f"{trial}_{serial}.txt"
    file.write_text("\n".join(lines) + "\n")
    return file

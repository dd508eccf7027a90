"""The formats that can be converted, and which of them a source is."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from mocap_jax.errors import InputError, unknown_name
from mocap_jax.io.convert import (
    apdm,
    apdm_csv,
    dip_imu,
    matlab,
    mvnx,
    plain_csv,
    total_capture,
    xio,
    xsens_mt,
)
from mocap_jax.io.convert.source import ReadOptions, Source

_MODULES = (xsens_mt, mvnx, xio, apdm, apdm_csv, matlab, total_capture, dip_imu, plain_csv)
FORMATS: dict[str, ModuleType] = {module.NAME: module for module in _MODULES}
"""Each gives `NAME`, `SUMMARY`, `CONVENTION`, `recognises(paths)` and `read(paths, options)`; the
order is that of recognition."""


def read_source(
    sources: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    format: str | None = None,
    options: ReadOptions = ReadOptions(),  # noqa: B008  (frozen)
) -> Source:
    """Read a recording of another system, as it stands.

    Args:
        sources: a file or folder, or several that belong together.
        format: one of `FORMATS`; None finds out.
        options: rate, mapping, trial.

    Raises:
        InputError: a source that does not exist, is of no known format, or is wrong.
    """
    paths = [Path(sources)] if isinstance(sources, str | os.PathLike) else [*map(Path, sources)]
    if not paths:
        raise InputError("no source to convert")
    for path in paths:
        if not path.exists():
            raise InputError(f"{path}: no such file or folder")
    if format is not None and format not in FORMATS:
        raise unknown_name("format", format, FORMATS)
    name = format or next((n for n, m in FORMATS.items() if m.recognises(paths)), None)
    if name is None:
        raise InputError(
            f"{paths[0]}: of no known format; name one (--format): "
            + ", ".join(f"{n} ({m.SUMMARY})" for n, m in FORMATS.items())
        )
    return FORMATS[name].read(paths, options)

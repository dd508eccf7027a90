"""Short waits for the compiler: programs kept between runs, and options that compile faster."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import jax

VARIABLE = "MOCAP_JAX_CACHE"
"""Environment variable that names the folder; `off` or empty switches the cache off."""

# Measured with JAX 0.10 on the programs of estimators, on two cores; later versions may not know
# these options. The newer emitters of fused loops take twice as long to compile and run no faster.
# YNNPACK's threads, and Eigen's, spend on waiting for each other what a second core is needed for.
_known = jax.__version_info__ < (0, 11)
COMPILER_OPTIONS: dict[str, bool | str] = (
    {
        "xla_cpu_use_fusion_emitters": False,
        "xla_cpu_experimental_ynn_fusion_type": "",
        "xla_cpu_multi_thread_eigen": False,
    }
    if _known
    else {}
)
"""For `jax.jit` of large programs; such a function cannot be called inside another one."""


def default_cache_folder() -> Path:
    """`~/.cache/mocap_jax`, or below `XDG_CACHE_HOME` where that is set."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(base) / "mocap_jax"


def enable_compilation_cache(folder: str | os.PathLike[str] | None = None) -> Path | None:
    """Store compiled JAX programs in a folder and reuse them in later processes.

    The command line and the scripts call this; a program that uses the package may call it once
    at its start. A folder that JAX already uses (`JAX_COMPILATION_CACHE_DIR`) is left in place.

    Args:
        folder: where to keep them; default `MOCAP_JAX_CACHE`, else `default_cache_folder()`.

    Returns:
        The folder in use, or None when the cache is off or the folder cannot be written.
    """
    if jax.config.jax_compilation_cache_dir:
        return Path(jax.config.jax_compilation_cache_dir)
    chosen = os.environ.get(VARIABLE, str(default_cache_folder())) if folder is None else folder
    if str(chosen) in ("", "off", "0"):
        return None
    path = Path(chosen).expanduser()
    if not _writable(path):
        return None
    jax.config.update("jax_compilation_cache_dir", str(path))
    # Below these, looking a program up costs about as much as compiling it.
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", 0)
    return path


def _writable(path: Path) -> bool:
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return True
    except OSError:
        return False

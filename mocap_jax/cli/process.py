"""What every process of the command line settles first, workers of `batch` included."""

from __future__ import annotations

import sys
import warnings
from typing import Any, cast


def prepare_process() -> None:
    """Compilation cache on, BLAS on one thread, warnings as single lines."""
    import scipy.linalg  # noqa: F401  (its BLAS must be loaded before it can be limited)
    from threadpoolctl import threadpool_limits

    from mocap_jax.compilation_cache import enable_compilation_cache

    enable_compilation_cache()
    # Small-matrix LAPACK on several threads was up to 30 times slower than on one.
    threadpool_limits(limits=1, user_api="blas")
    warnings.showwarning = cast(Any, _show_warning)


def _show_warning(message: Warning | str, category: type[Warning], *where: Any) -> None:
    del where
    if issubclass(category, UserWarning | RuntimeWarning):
        print(f"mocap-jax: warning: {' '.join(str(message).split())}", file=sys.stderr)

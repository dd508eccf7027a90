"""The prior that comes with the package."""

from __future__ import annotations

from functools import cache
from importlib.resources import as_file, files

from mocap_jax.pose_prior.file import load_pose_prior
from mocap_jax.pose_prior.prior import PosePrior


@cache
def default_pose_prior() -> PosePrior:
    """Learned from nine clips of five people of the CMU database (scripts/learn_pose_prior).

    Acknowledgement: the data used was obtained from mocap.cs.cmu.edu; that database was created
    with funding from NSF EIA-0196217.
    """
    with as_file(files("mocap_jax") / "data" / "pose_prior.json") as path:
        return load_pose_prior(path)

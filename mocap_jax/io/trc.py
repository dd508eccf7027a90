"""Motions as TRC text: trajectories of points, for OpenSim and marker software.

Millimetres, Y up: our (x, y, z) is written (x, z, -y), as in OpenSim's ground. The points are the
joint centres, one for each segment under its name, and all sites of the body (sensors, sources,
virtual markers); a `/` in a name becomes `.`, since OpenSim takes it for a path.
"""

from __future__ import annotations

import numpy as np

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.io.opensim_motion import R_GROUND_WORLD, finite_poses, rate_of
from mocap_jax.io.world_frames import world_frames
from mocap_jax.trajectory import Trajectory

_MILLIMETRES = 1000.0
_TURNING = ("hinge", "ball")


def trc_text(body: Body, trajectory: Trajectory) -> str:
    """Joint centres and sites over time.

    Raises:
        InputError: poses that are not finite, or uneven times (the header states one rate).
    """
    q = finite_poses(trajectory, "TRC")
    time = np.asarray(trajectory.time, float)
    rate = rate_of(time)
    if len(time) > 2 and np.abs(np.diff(time) * rate - 1.0).max() > 0.05:
        raise InputError("TRC needs evenly spaced times")
    names, points = _points(body, q)
    points = points @ R_GROUND_WORLD.T * _MILLIMETRES
    count, n = len(time), len(names)
    numbered = [f"{axis}{i + 1}" for i in range(n) for axis in "XYZ"]
    head = [
        "PathFileType\t4\t(X/Y/Z)\tmocap_jax.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
        "OrigNumFrames",
        f"{rate:.6g}\t{rate:.6g}\t{count}\t{n}\tmm\t{rate:.6g}\t1\t{count}",
        "\t".join(["Frame#", "Time", "\t\t\t".join(names)]) + "\t\t",
        "\t".join(["", "", *numbered]),
        "",
    ]
    rows = [
        "\t".join([str(k + 1), f"{t:.10g}", *(f"{x:.6f}" for x in frame)])
        for k, (t, frame) in enumerate(
            zip(time.tolist(), points.reshape(count, -1).tolist(), strict=True)
        )
    ]
    return "\n".join([*head, *rows]) + "\n"


def _points(body: Body, q: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Names, and positions (t, n, 3) in the world [m]."""
    topology = body.topology
    rotation, origin = world_frames(body, q)
    on = [*range(1, topology.nbody), *topology.site_body]
    local = np.zeros((len(on), 3))
    for b in range(1, topology.nbody):
        turning = [j for j in topology.joints_of_body(b) if topology.joint_types[j] in _TURNING]
        if turning:
            local[b - 1] = np.asarray(body.joint_pos)[turning[-1]]
    local[topology.nbody - 1 :] = np.asarray(body.site_pos)
    points = origin[:, on] + np.einsum("tnij,nj->tni", rotation[:, on], local)
    names = [*topology.body_names[1:], *topology.site_names]
    return _unique(["_".join(n.split()) for n in names]), points


def _unique(names: list[str]) -> list[str]:
    """Names without `/`; one that is taken gets `_site`, and numbers if need be."""
    out: list[str] = []
    for name in (n.replace("/", ".") for n in names):
        tried, number = name, 1
        while tried in out:
            tried, number = f"{name}_site" + (str(number) if number > 1 else ""), number + 1
        out.append(tried)
    return out

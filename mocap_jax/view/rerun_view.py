"""`show_view`, `save_view`: figures that move, with their joint angles, for Rerun."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.io.atomic import atomic_file
from mocap_jax.metrics.align import truth_of
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution
from mocap_jax.solution.angles import joint_angles
from mocap_jax.solution.poses import segment_poses
from mocap_jax.trajectory import Trajectory
from mocap_jax.view.shapes import Rounds, SegmentShape, segment_shapes

MISSING = "view needs the Rerun SDK: pip install 'mocap_jax[viewer]'"
APPLICATION = "mocap_jax"
TIMELINE = "time"
# Of estimates in turn, and of the truth (RGB).
_COLOURS = ((31, 119, 180), (214, 96, 20), (44, 140, 80), (150, 80, 170))
_TRUTH = (150, 150, 150)
_SENSOR = (20, 20, 20)


def show_view(solutions: dict[str, Solution], recording: Recording | None = None) -> None:
    """Open solutions in the Rerun viewer.

    Args:
        solutions: by the name they are shown under.
        recording: its truth is shown as well, in grey.

    Raises:
        InputError: Rerun is not installed, there is no display, or its viewer does not start.
    """
    stream = _stream()
    on_screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if sys.platform.startswith("linux") and not on_screen:
        raise InputError("view: no display to open a window on; write a file with -o FILE.rrd")
    try:
        stream.spawn()
    except (RuntimeError, OSError) as error:
        raise InputError(f"view: the Rerun viewer does not start ({error})") from error
    _log(stream, solutions, recording)
    stream.flush()


def save_view(
    path: str | os.PathLike[str], solutions: dict[str, Solution],
    recording: Recording | None = None,
) -> None:  # fmt: skip
    """Write what `show_view` shows to a file of Rerun (.rrd), whole or not at all.

    Raises:
        InputError: Rerun is not installed, or the file cannot be written.
    """
    stream = _stream()
    content = stream.binary_stream()
    _log(stream, solutions, recording)
    with atomic_file(path) as file:
        file.write(content.read(flush=True) or b"")


def _stream() -> Any:
    try:
        import rerun
    except ImportError as error:
        raise InputError(MISSING) from error
    return rerun.RecordingStream(APPLICATION)


def _log(stream: Any, solutions: dict[str, Solution], recording: Recording | None) -> None:
    import rerun
    from rerun import blueprint

    stream.send_blueprint(
        blueprint.Blueprint(
            blueprint.Horizontal(
                blueprint.Spatial3DView(origin="/world"),
                blueprint.TimeSeriesView(origin="/angles"),
            )
        )
    )
    stream.log("world", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for i, (name, solution) in enumerate(solutions.items()):
        colour = _COLOURS[i % len(_COLOURS)]
        worn = {s.site for s in solution.setup.sensors} | set(solution.setup.sources)
        _figure(stream, name, solution.body, solution.trajectory, colour, worn)
    if recording is not None and recording.truth is not None:
        _figure(stream, "truth", *truth_of(recording), _TRUTH, set())


def _figure(
    stream: Any, name: str, body: Body, trajectory: Trajectory, colour: tuple[int, int, int],
    worn: set[str],
) -> None:  # fmt: skip
    """A body that moves, and the angles of its joints [deg]."""
    import rerun

    time = rerun.TimeColumn(TIMELINE, duration=np.asarray(trajectory.time))
    R_world_segment, position = segment_poses(body, np.asarray(trajectory.q))
    shapes = segment_shapes(body)
    for i, segment in enumerate(body.topology.body_names):
        if i == 0:
            continue
        path = f"world/{name}/{segment}"
        stream.send_columns(
            path, indexes=[time],
            columns=rerun.Transform3D.columns(
                translation=position[:, i], mat3x3=R_world_segment[:, i]
            ),
        )  # fmt: skip
        _stand(stream, path, shapes[segment], colour, worn)
    names, angles = joint_angles(body, trajectory)
    for label, values in zip(names, np.rad2deg(angles).T, strict=True):
        path = f"angles/{label}/{name}"
        stream.log(path, rerun.SeriesLines(colors=[colour], names=[name]), static=True)
        stream.send_columns(path, indexes=[time], columns=rerun.Scalars.columns(scalars=values))


def _stand(
    stream: Any, path: str, shape: SegmentShape, colour: tuple[int, int, int], worn: set[str]
) -> None:
    """What stands still in a segment's frame."""
    import rerun

    solid = rerun.components.FillMode.Solid
    for kind, solids in (("ellipsoids", shape.ellipsoids), ("boxes", shape.boxes)):
        if solids.centre:
            make = rerun.Ellipsoids3D if kind == "ellipsoids" else rerun.Boxes3D
            stream.log(f"{path}/{kind}", make(
                half_sizes=solids.size, centers=solids.centre, quaternions=solids.quaternion,
                colors=[colour], fill_mode=solid,
            ), static=True)  # fmt: skip
    if shape.cylinders.centre:
        s = shape.cylinders
        stream.log(f"{path}/cylinders", rerun.Cylinders3D(
            lengths=[2 * x[1] for x in s.size], radii=[x[0] for x in s.size], centers=s.centre,
            quaternions=s.quaternion, colors=[colour], fill_mode=solid,
        ), static=True)  # fmt: skip
    if shape.capsules.centre:
        s = shape.capsules
        stream.log(f"{path}/capsules", rerun.Capsules3D(
            lengths=[2 * x[1] for x in s.size], radii=[x[0] for x in s.size],
            translations=_starts(s), quaternions=s.quaternion, colors=[colour], fill_mode=solid,
        ), static=True)  # fmt: skip
    if shape.bones:
        stream.log(f"{path}/bones", rerun.LineStrips3D(shape.bones, colors=[colour]), static=True)
    sites = {site: place for site, place in shape.sites.items() if site in worn}
    if sites:
        stream.log(f"{path}/sensors", rerun.Points3D(
            list(sites.values()), labels=list(sites), radii=0.012, colors=[_SENSOR],
            show_labels=False,
        ), static=True)  # fmt: skip


def _starts(capsules: Rounds) -> list[np.ndarray]:
    """Rerun's capsules begin at their place and go along z; MuJoCo's have it in the middle."""
    from scipy.spatial.transform import Rotation

    return [
        centre - size[1] * Rotation.from_quat(quaternion).as_matrix()[:, 2]
        for centre, quaternion, size in zip(
            capsules.centre, capsules.quaternion, capsules.size, strict=True
        )
    ]

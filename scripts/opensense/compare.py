"""Both solves on the same data, and the table of their differences."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from opensense import data
from opensense.run_opensim import OpensimMotion, run_ik, run_kinematics

MODEL = "Rajagopal_2015.osim"
# Largest root-mean-square difference from OpenSim of these angles [deg].
FLEXIONS = ("hip_flexion", "knee_angle", "ankle_angle")
ALLOWED_DEG = 0.5
SHIFTS = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
REPEATS = 3


class Walk:
    """The files, placed on the model."""

    def __init__(self, folder: Path, interval: tuple[float, float]) -> None:
        self.folder, self.interval = folder, interval
        self.model = folder / MODEL
        self.recording = data.read_walk(folder)

    @cached_property
    def calibration(self):
        """As OpenSense does it, its angle of heading included."""
        import mocap_jax as mj

        return mj.calibrate_to_pose(
            self.recording,
            mj.load_body(self.model),
            {name: name.removesuffix("_imu") for name in self.recording.inertial},
            heading=mj.Heading("pelvis_imu", "z", "opensense"),
        )

    @cached_property
    def recording_in_range(self):
        """The calibrated recording within the time range."""
        return data.cut(self.calibration.recording, *self.interval)


@dataclass(frozen=True)
class Ours:
    """Our solution and how fast it was found."""

    solution: object
    names: tuple[str, ...]
    degrees: np.ndarray
    """Angles over time, the root without the turn by the heading, as OpenSim reports it."""
    time: np.ndarray
    summary: dict[str, float]

    @property
    def text(self) -> str:
        s = self.summary
        return (
            f"ours: {s['frames']:.0f} frames in {s['wall']:.2f} s ({s['cpu']:.2f} s of processor "
            f"time): {s['frames_per_second']:.0f} frames/s, {s['frames_per_cpu_second']:.0f} a "
            f"processor second (compilation {s['compile']:.0f} s before); root-mean-square angle "
            f"of error of the sensors {s['sensor_error_deg']:.3f} deg"
        )


def solve(walk: Walk) -> Ours:
    """Run the orientation pass; the time is the best of a few runs, compilation not counted."""
    import mocap_jax as mj

    recording, body = walk.recording_in_range, walk.calibration.body
    compiling = mj.orientation_pass(recording, body).seconds_compile
    runs = []
    for _ in range(REPEATS):
        begin = time.perf_counter(), time.process_time()
        solution = mj.orientation_pass(recording, body)
        runs.append((time.perf_counter() - begin[0], time.process_time() - begin[1]))
    wall, cpu = (min(r[i] for r in runs) for i in (0, 1))
    names, degrees = angles(solution, walk.calibration.heading)
    count = len(solution.trajectory.time)
    error = np.sqrt(2.0 * solution.cost[0] / (count * len(recording.inertial)))
    summary = {
        "frames": float(count), "wall": wall, "cpu": cpu, "compile": compiling,
        "frames_per_second": count / wall, "frames_per_cpu_second": count / cpu,
        "sensor_error_deg": float(np.degrees(error)),
    }  # fmt: skip
    return Ours(solution, names, degrees, np.asarray(solution.trajectory.time), summary)


def angles(solution, heading: float) -> tuple[tuple[str, ...], np.ndarray]:
    """OpenSim's names of all angles, and their values [deg]."""
    from mocap_jax.body.opensim import coordinates_from_poses

    q = np.array(solution.trajectory.q)
    # OpenSim's inverse kinematics leaves the heading in the data.
    back = Rotation.from_euler("z", -heading) * Rotation.from_quat(q[:, 3:7], scalar_first=True)
    q[:, 3:7] = back.as_quat(scalar_first=True)
    found = coordinates_from_poses(solution.body, q)
    turns = np.flatnonzero(found.turns)
    return tuple(found.names[i] for i in turns), np.degrees(found.values[:, turns])


def solve_with_opensim(walk: Walk, python: str, folder: Path) -> OpensimMotion:
    """OpenSim's own tools on the same files."""
    table = folder / "orientations.sto"
    data.write_orientations(table, walk.recording)
    motion = run_ik(python, walk.model, table, folder, walk.interval)
    count = len(motion.time)
    seconds = motion.seconds | {
        "sensor_error_deg": sensor_error(walk, motion),
        "frames": count,
        "frames_per_second": count / motion.seconds["wall"],
        "frames_per_cpu_second": count / motion.seconds["cpu"],
    }
    return dataclasses.replace(motion, seconds=seconds)


def kinematics(walk: Walk, python: str, folder: Path) -> tuple[str, dict[str, float]]:
    """Largest differences of our frames from OpenSim's at random poses, but for kneecaps."""
    import mocap_jax as mj
    from mocap_jax.body.opensim import R_WORLD_GROUND, pose_from_coordinates
    from mocap_jax.io.world_frames import world_frames

    body = mj.load_body(walk.model)
    below = tuple(body.topology.body_index(f"{n}_{s}") for n in ("tibia", "talus", "calcn", "toes")
                  for s in "rl")  # fmt: skip
    worst = {"rotation": 0.0, "position_m": 0.0, "position_below_knee_m": 0.0}
    for pose in run_kinematics(python, walk.model, folder):
        R, p = world_frames(body, pose_from_coordinates(body, pose["q"])[None])
        for name, frame in pose["frames"].items():
            if name.startswith("patella"):
                continue
            b = body.topology.body_index(name)
            turn = np.abs(R_WORLD_GROUND.as_matrix() @ frame["R"] - R[0, b]).max()
            shift = np.linalg.norm(R_WORLD_GROUND.apply(frame["p"]) - p[0, b])
            key = "position_below_knee_m" if b in below else "position_m"
            worst["rotation"] = max(worst["rotation"], float(turn))
            worst[key] = max(worst[key], float(shift))
    text = (
        f"kinematics at random poses, largest difference from OpenSim: rotation matrices "
        f"{worst['rotation']:.1e}, positions {worst['position_m']:.1e} m, below the knees "
        f"{1000 * worst['position_below_knee_m']:.2f} mm"
    )
    return text, worst


def sensor_error(walk: Walk, motion: OpensimMotion) -> float:
    """Root-mean-square angle between measured sensors and those at OpenSim's coordinates [deg]."""
    import jax

    import mocap_jax as mj
    from mocap_jax.body.opensim import coordinates_from_poses, pose_from_coordinates

    body, recording = walk.calibration.body, walk.recording_in_range
    names = coordinates_from_poses(body, np.asarray(body.qpos0)[None]).names
    turned = {n: motion.columns[n] * (1.0 if n in SHIFTS else np.pi / 180)
              for n in names}  # fmt: skip
    q = np.array(
        [pose_from_coordinates(body, {n: float(x[k]) for n, x in turned.items()})
         for k in range(len(motion.time))]
    )  # fmt: skip
    facing = Rotation.from_euler("z", walk.calibration.heading)
    root = facing * Rotation.from_quat(q[:, 3:7], scalar_first=True)
    q[:, 3:7] = root.as_quat(scalar_first=True)
    R = np.asarray(jax.jit(jax.vmap(lambda one: mj.site_frames(body, one).rotation))(q))
    squared = []
    for name, stream in recording.inertial.items():
        at = np.abs(np.asarray(stream.time)[:, None] - motion.time).argmin(axis=0)
        seen = Rotation.from_quat(np.asarray(stream.orientation)[at], scalar_first=True)
        predicted = Rotation.from_matrix(R[:, body.topology.site_index(name)])
        squared.append((seen.inv() * predicted).magnitude() ** 2)
    return float(np.degrees(np.sqrt(np.mean(squared))))


def table(ours: Ours, theirs: OpensimMotion) -> tuple[str, dict[str, dict[str, float]], int]:
    """Text, differences by coordinate, and 1 where a flexion is too far off."""
    at = np.abs(ours.time[:, None] - theirs.time).argmin(axis=0)
    rows, status = {}, 0
    observed = _observed(ours)
    s = theirs.seconds
    lines = [
        f"OpenSim: {s['frames']:.0f} frames in {s['wall']:.2f} s ({s['cpu']:.2f} s of processor "
        f"time): {s['frames_per_second']:.0f} frames/s, {s['frames_per_cpu_second']:.0f} a "
        f"processor second; root-mean-square angle of error {s['sensor_error_deg']:.3f} deg",
        f"ours / OpenSim: {ours.summary['frames_per_second'] / s['frames_per_second']:.0f} times "
        "the frames a second, "
        f"{ours.summary['frames_per_cpu_second'] / s['frames_per_cpu_second']:.0f} times those a "
        "processor second",
        f"{'coordinate [deg]':20s} {'rms':>7s} {'largest':>8s}   {'OpenSim: from':>13s} {'to':>7s}",
    ]
    for i, name in enumerate(ours.names):
        if name not in observed:
            continue
        other = theirs.columns[name]
        apart = (ours.degrees[at, i] - other + 180.0) % 360.0 - 180.0
        rows[name] = {"rms": float(np.sqrt((apart**2).mean())), "largest": float(abs(apart).max())}
        flexion = name.removesuffix("_r").removesuffix("_l") in FLEXIONS
        wrong = flexion and rows[name]["rms"] > ALLOWED_DEG
        status |= int(wrong)
        mark = "  TOO FAR" if wrong else ""
        lines.append(
            f"{name:20s} {rows[name]['rms']:7.3f} {rows[name]['largest']:8.3f}   "
            f"{other.min():13.1f} {other.max():7.1f}{mark}"
        )
    lines.append("(coordinates between no two sensors are left out: arms)")
    return "\n".join(lines), rows, status


def _observed(ours: Ours) -> set[str]:
    """Coordinates that the sensors determine: those of joints on their chains, and the root's."""
    topology = ours.solution.body.topology
    worn = {topology.site_body[i] for i in range(len(topology.site_names))}
    above = set(worn)
    for b in worn:
        while topology.body_parent[b]:
            b = topology.body_parent[b]
            above.add(b)
    joints = zip(topology.joint_names, topology.joint_body, strict=True)
    names = {n for n, b in joints if b in above}
    return {n for n in ours.names if n in names or n.startswith("pelvis_")}


def ranges_text(ours: Ours) -> str:
    """Our angles alone."""
    observed = _observed(ours)
    lines = [f"{'coordinate [deg]':20s} {'mean':>7s} {'from':>7s} {'to':>7s}"]
    for i, name in enumerate(ours.names):
        if name in observed:
            x = ours.degrees[:, i]
            lines.append(f"{name:20s} {x.mean():7.1f} {x.min():7.1f} {x.max():7.1f}")
    return "\n".join(lines)

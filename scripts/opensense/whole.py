"""What the whole-sequence solve with accelerations changes."""

from __future__ import annotations

import dataclasses

import numpy as np

from opensense import data
from opensense.compare import FLEXIONS, Ours, Walk, angles

SHOWN = tuple(f"{name}_{side}" for name in (*FLEXIONS, "hip_adduction", "hip_rotation")
              for side in "rl")  # fmt: skip


# The wearer stands still in the calibration pose at the start of the recording [s].
STILL = 1.9
# Model errors: what the skeleton leaves of orientations (the orientation pass: 6 degrees) [rad],
# and of accelerations [m/s^2].
MISFIT, FORCES = 0.1, 1.0
# Sensors sit somewhere on their segments; the guess is the centre of mass [m].
PLACES = 0.08


def run(walk: Walk, ours: Ours, picture: str | None) -> tuple[str, dict[str, object]]:
    """Solve from the orientation pass; table, numbers and, where asked for, the picture."""
    import mocap_jax as mj

    recording, body = _from_rest(walk), walk.calibration.body
    options = mj.OptimiseOptions(
        kinds="AO", root="free", covariance=False,
        noise=mj.NoiseOptions(orientation_model=MISFIT, accelerometer_model=FORCES),
        constants=mj.ConstantsOptions(offset_sigma=PLACES),
    )  # fmt: skip
    start = mj.orientation_pass(recording, body)
    solution = mj.optimise(recording, body, initial=start, options=options)
    _, degrees = angles(solution, walk.calibration.heading)
    times = np.asarray(solution.trajectory.time)
    degrees = degrees[np.abs(times[:, None] - ours.time).argmin(axis=0)]
    rows = {}
    step = float(np.median(np.diff(ours.time)))
    lines = [
        f"whole sequence with accelerations: {solution.status.value} {solution.iterations} steps, "
        f"{solution.seconds_solve:.1f} s",
        f"{'coordinate':20s} {'change rms':>10s} {'largest':>8s} [deg]   "
        f"{'acceleration rms: before':>25s} {'after':>8s} [deg/s^2]",
    ]
    for name in SHOWN:
        i = ours.names.index(name)
        before, after = ours.degrees[:, i], degrees[:, i]
        bent = [float(np.sqrt((np.diff(x, 2) ** 2).mean()) / step**2) for x in (before, after)]
        change = after - before
        rows[name] = {
            "change_rms_deg": float(np.sqrt((change**2).mean())),
            "change_largest_deg": float(abs(change).max()),
            "acceleration_before": bent[0], "acceleration_after": bent[1],
        }  # fmt: skip
        lines.append(
            f"{name:20s} {rows[name]['change_rms_deg']:10.2f} "
            f"{rows[name]['change_largest_deg']:8.2f}         {bent[0]:25.0f} {bent[1]:8.0f}"
        )
    sensors = {k: dict(v) for k, v in solution.statistics.items()}
    if picture:
        draw(picture, ours, degrees)
    about = {"status": solution.status.name, "seconds_solve": solution.seconds_solve,
             "iterations": solution.iterations, "remarks": solution.remarks,
             "sensor_positions_m": {
                 k: v.tolist() for k, v in solution.calibration.items() if "offset" in k
             }}  # fmt: skip
    return "\n".join(lines), about | {"angles": rows, "residuals": sensors}


def _from_rest(walk: Walk):
    """The recording from its start on, which is declared as a rest hold."""
    from mocap_jax.recording import RestHold

    recording = data.cut(walk.calibration.recording, 0.0, walk.interval[1])
    setup = dataclasses.replace(recording.setup, rest=RestHold(0.0, STILL))
    return dataclasses.replace(recording, setup=setup)


def draw(path: str, ours: Ours, degrees: np.ndarray) -> None:
    """Hip, knee and ankle flexion of both sides, before and after."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(3, 2, figsize=(9, 6), sharex=True, layout="constrained")
    for row, name in enumerate(FLEXIONS):
        for column, (side, word) in enumerate((("r", "right"), ("l", "left"))):
            i = ours.names.index(f"{name}_{side}")
            axis = axes[row, column]
            axis.plot(ours.time, ours.degrees[:, i], lw=1.0, label="orientations, frame by frame")
            axis.plot(ours.time, degrees[:, i], lw=1.0, label="whole sequence, accelerations too")
            axis.set_title(f"{name.replace('_', ' ')}, {word}", fontsize=9)
            axis.set_ylabel("deg")
    axes[0, 0].legend(fontsize=7)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    figure.savefig(path, dpi=110)
    plt.close(figure)

"""What can be said of an estimate without a reference: closure, slip, residuals, plausibility."""

from __future__ import annotations

import numpy as np

from qmt.ranges import RANGES

# Standing upright and still, as the first second is [s]; and sitting still, from .. to.
STANDING = {"start": (0.2, 1.8), "after sitting": (46.0, 47.3), "before walking": (52.7, 53.6)}
SITTING = ((18.0, 20.0), (36.0, 38.0))
# Segments whose headings stay when feet do and somebody stands again.
_TRUNK = ("Pelvis", "L5", "T8")
_LEGS = tuple(s + n for s in ("Right", "Left") for n in ("UpperLeg", "LowerLeg", "Foot"))


def poses(solution):
    """Names, times, rotations (t, b, 3, 3) and positions (t, b, 3) of the segments."""
    from mocap_jax.solution.poses import segment_poses

    R, position = segment_poses(solution.body, np.asarray(solution.trajectory.q))
    return solution.body.topology.body_names, np.asarray(solution.trajectory.time), R, position


def closure(solution) -> dict[str, float | None]:
    """Headings in later stances against the first, and drift while sitting still [deg]."""
    names, time, R, _ = poses(solution)
    yaw = {n: np.unwrap(np.arctan2(R[:, i, 1, 0], R[:, i, 0, 0])) for i, n in enumerate(names)}

    def mean(name: str, span: tuple[float, float]) -> float:
        inside = (time >= span[0]) & (time <= span[1])
        return float(np.rad2deg(yaw[name][inside].mean())) if inside.any() else np.nan

    def wrapped(angle: float) -> float:
        return float((angle + 180) % 360 - 180)

    out: dict[str, float | None] = {}
    first, *later = STANDING
    for word in later:
        span = STANDING[word]
        out[f"pelvis_yaw_{word.replace(' ', '_')}_deg"] = wrapped(
            mean("Pelvis", span) - mean("Pelvis", STANDING[first])
        )
        turn = [
            wrapped(mean(n, span) - mean("Pelvis", span)
                    - mean(n, STANDING[first]) + mean("Pelvis", STANDING[first]))
            for n in (*_TRUNK[1:], *_LEGS)
        ]  # fmt: skip
        out[f"yaw_against_pelvis_{word.replace(' ', '_')}_rms_deg"] = _rms(turn)
    drift = [
        wrapped(mean(n, SITTING[1]) - mean(n, SITTING[0])) for n in (*_TRUNK, *_LEGS) if n in yaw
    ]
    out["yaw_drift_sitting_18_s_rms_deg"] = _rms(drift)
    return {k: None if np.isnan(v) else round(v, 2) for k, v in out.items()}


def _rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def slip(solution, recording, pose) -> dict[str, float]:
    """How far feet move while their own boards say that they stand, and how level they stand [cm].

    The stances are the same for all estimates of one recording.
    """
    from mocap_jax.estimate.contact.detect import standing_boards
    from mocap_jax.estimate.contact.feet import feet_of, positions
    from mocap_jax.estimate.contact.options import ContactOptions
    from mocap_jax.measurement import gather

    body = solution.body
    rate = 1 / float(np.median(np.diff(np.asarray(solution.trajectory.time))))
    data = gather(recording, body, kinds="AG", rate_hz=rate)
    feet = feet_of(body, pose)
    standing = standing_boards(data, body, feet, ContactOptions())
    place = positions(body, feet, np.asarray(solution.trajectory.q))
    moved, height, seconds = [], [], 0.0
    for foot in np.unique(feet.feet):
        points = np.flatnonzero(feet.feet == foot)
        middle = place[:, points].mean(axis=1)
        on = np.concatenate([[0], standing[:, points[0]].astype(int), [0]])
        for a, b in zip(np.flatnonzero(np.diff(on) > 0), np.flatnonzero(np.diff(on) < 0),
                        strict=True):  # fmt: skip
            way = middle[a:b] - middle[a]
            moved.append(100 * np.linalg.norm(way, axis=1).max())
            height.append(100 * place[a:b][:, points, 2].mean())
            seconds += (b - a) / rate
    return {
        "stances": len(moved), "standing_s": round(seconds, 1),
        "slip_median_cm": round(float(np.median(moved)), 2),
        "slip_mean_cm": round(float(np.mean(moved)), 2),
        "slip_95_percent_cm": round(float(np.percentile(moved, 95)), 2),
        "height_of_stances_std_cm": round(float(np.std(height)), 2),
    }  # fmt: skip


def residuals(solution) -> dict[str, dict[str, float]]:
    """RMS of what is left, per sensor: acceleration [m/s^2], rate [deg/s], orientation [deg]."""
    scale = {"accelerometer": 1.0, "gyroscope": np.rad2deg(1), "orientation": np.rad2deg(1)}
    out: dict[str, dict[str, float]] = {}
    for key, values in solution.statistics.items():
        kind, _, sensor = key.partition("/")
        if kind in scale:
            out.setdefault(sensor, {})[kind] = round(values["rms_units"] * scale[kind], 3)
    return out


def plausibility(solution) -> dict[str, dict[str, float]]:
    """Every joint angle: share of the time within the published range [%], and what it does."""
    from mocap_jax.solution.anatomy import anatomical_frames, rotation_labels
    from mocap_jax.solution.cardan import cardan_zxy, continuous

    names, _, R, _ = poses(solution)
    A = R @ anatomical_frames(solution.body)
    out = {}
    for (child, parent), ranges in RANGES.items():
        i, j = names.index(child), names.index(parent)
        zxy = np.rad2deg(continuous(cardan_zxy(np.swapaxes(A[:, j], -1, -2) @ A[:, i])))
        zxy -= 360 * np.round(np.median(zxy, axis=0) / 360)
        for k, (label, sign) in enumerate(rotation_labels(child)):
            if label not in ranges:
                continue
            angle, (low, high) = sign * zxy[:, k], ranges[label]
            out[f"{child} in {parent}: {label}"] = {
                "within_percent": round(100 * float(((angle >= low) & (angle <= high)).mean()), 1),
                "percentile_1_deg": round(float(np.percentile(angle, 1)), 1),
                "percentile_99_deg": round(float(np.percentile(angle, 99)), 1),
                "low_deg": low, "high_deg": high,
            }  # fmt: skip
    return out

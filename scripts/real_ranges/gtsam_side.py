"""GTSAM (extra `ranges`) on the Plaza 2 data.

- `example`: GTSAM's own example RangeISAMExample_plaza2: iSAM2, beacons unknown, its noise figures.
- `plain`: batch Levenberg-Marquardt, beacons known, our noise figures and robust loss; GTSAM's
  range factor knows no bias. Ranges belong to the nearest pose.
- `custom`: our model written as GTSAM custom factors: turn-rate error, scale, biases.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from real_ranges.plaza2 import Plaza2

# Of RangeISAMExample_plaza2.cpp.
_EXAMPLE_START = {
    1: (3.5784, 2.76944), 6: (-1.34989, 3.03492), 0: (0.725404, -0.0630549),
    5: (0.714743, -0.204966),
}  # fmt: skip
_EXAMPLE_ODOMETRY, _EXAMPLE_RANGE, _EXAMPLE_TUKEY = (0.05, 0.01, 0.2), 100.0, 15.0
_FIRST, _EVERY = 150, 25


def example(data: Plaza2) -> np.ndarray:
    """Path (t, 3) of the example's settings; beacons are unknowns that start nowhere near."""
    import gtsam

    noise = gtsam.noiseModel.Diagonal.Sigmas(np.array(_EXAMPLE_ODOMETRY))
    tukey = gtsam.noiseModel.mEstimator.Tukey.Create(_EXAMPLE_TUKEY)
    ranging = gtsam.noiseModel.Robust.Create(
        tukey, gtsam.noiseModel.Isotropic.Sigma(1, _EXAMPLE_RANGE)
    )
    identities = list(data.beacons)
    isam, graph, initial = gtsam.ISAM2(), gtsam.NonlinearFactorGraph(), gtsam.Values()
    pose = gtsam.Pose2(*data.start)
    prior = gtsam.noiseModel.Diagonal.Sigmas(np.array([1.0, 1.0, np.pi]))
    graph.add(gtsam.PriorFactorPose2(0, pose, prior))
    initial.insert(0, pose)
    for identity, point in _EXAMPLE_START.items():
        initial.insert(gtsam.symbol("L", identity), np.array(point))
    done = waiting = 0
    started = False
    for i, (t, d, turn) in enumerate(
        zip(data.odometry.time[1:], data.odometry.distance, data.odometry.turn, strict=True), 1
    ):
        step = gtsam.Pose2(d, 0.0, turn)
        graph.add(gtsam.BetweenFactorPose2(i - 1, i, step, noise))
        pose = pose.compose(step)
        initial.insert(i, pose)
        while done < len(data.ranges.range) and t >= data.ranges.time[done]:
            beacon = gtsam.symbol("L", identities[data.ranges.anchor[done]])
            graph.add(gtsam.RangeFactor2D(i, beacon, data.ranges.range[done], ranging))
            done, waiting = done + 1, waiting + 1
        if done > _FIRST and waiting > _EVERY:
            if not started:
                initial = gtsam.LevenbergMarquardtOptimizer(graph, initial).optimize()
                started = True
            isam.update(graph, initial)
            pose = isam.calculateEstimate().atPose2(i)
            graph, initial, waiting = gtsam.NonlinearFactorGraph(), gtsam.Values(), 0
    # As in the example, steps behind the last update stay predicted.
    estimate = isam.calculateEstimate()
    estimate.insert(initial)
    return _poses(estimate, len(data.odometry.time))


def plain(data: Plaza2, options: Any, first: np.ndarray) -> np.ndarray:
    """Path (t, 3) with known beacons and GTSAM's own factors."""
    import gtsam

    graph, values = _with_steps(data, options, first, bias=False)
    ranging, tight = _ranging(options), gtsam.noiseModel.Isotropic.Sigma(2, 1e-3)
    for a, point in enumerate(data.anchors):
        values.insert(gtsam.symbol("L", a), point)
        graph.add(gtsam.PriorFactorPoint2(gtsam.symbol("L", a), point, tight))
    times = data.odometry.time
    for t, a, r in zip(data.ranges.time, data.ranges.anchor, data.ranges.range, strict=True):
        nearest = int(np.argmin(np.abs(times - t)))
        graph.add(gtsam.RangeFactor2D(nearest, gtsam.symbol("L", int(a)), float(r), ranging))
    return _poses(gtsam.LevenbergMarquardtOptimizer(graph, values).optimize(), len(times))


def custom(data: Plaza2, options: Any, first: np.ndarray) -> np.ndarray:
    """Path (t, 3) of our model in GTSAM's hands."""
    import gtsam

    graph, values = _with_steps(data, options, first, bias=True)
    key, count = gtsam.symbol("C", 0), 2 + len(data.anchors)
    sigma = [options.turn_bias_sigma, options.scale_sigma]
    sigma += [options.bias_sigma] * len(data.anchors)
    values.insert(key, np.zeros(count))
    graph.add(
        gtsam.PriorFactorVector(key, np.zeros(count), gtsam.noiseModel.Diagonal.Sigmas(sigma))
    )
    ranging, times = _ranging(options), data.odometry.time
    for t, a, r in zip(data.ranges.time, data.ranges.anchor, data.ranges.range, strict=True):
        k = int(np.clip(np.searchsorted(times, t, "right") - 1, 0, len(times) - 2))
        share = float(np.clip((t - times[k]) / (times[k + 1] - times[k]), 0, 1))
        error = partial(_range_error, int(a), data.anchors[a], share, float(r))
        graph.add(gtsam.CustomFactor(ranging, [k, k + 1, key], error))
    return _poses(gtsam.LevenbergMarquardtOptimizer(graph, values).optimize(), len(times))


def _with_steps(data: Plaza2, options: Any, first: np.ndarray, *, bias: bool) -> tuple[Any, Any]:
    """Graph and values with the start and the odometry."""
    import gtsam

    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for i, pose in enumerate(first):
        values.insert(i, gtsam.Pose2(*pose))
    sigma = np.array([options.start_sigma[0]] * 2 + [options.start_sigma[1]])
    graph.add(
        gtsam.PriorFactorPose2(0, gtsam.Pose2(*data.start), gtsam.noiseModel.Diagonal.Sigmas(sigma))
    )
    density = np.array([options.forward_noise, options.sideways_noise, options.turn_noise])
    steps = np.diff(data.odometry.time)
    for i, (h, d, turn) in enumerate(
        zip(steps, data.odometry.distance, data.odometry.turn, strict=True)
    ):
        noise = gtsam.noiseModel.Diagonal.Sigmas(density * np.sqrt(h))
        if bias:
            error = partial(_step_error, float(d), float(turn), float(h))
            graph.add(gtsam.CustomFactor(noise, [i, i + 1, gtsam.symbol("C", 0)], error))
        else:  # the way of a step points along its mean heading
            way = gtsam.Pose2(d * np.cos(turn / 2), d * np.sin(turn / 2), turn)
            graph.add(gtsam.BetweenFactorPose2(i, i + 1, way, noise))
    return graph, values


def _ranging(options: Any) -> Any:
    import gtsam

    cauchy = gtsam.noiseModel.mEstimator.Cauchy.Create(options.loss_scale)
    return gtsam.noiseModel.Robust.Create(
        cauchy, gtsam.noiseModel.Isotropic.Sigma(1, options.range_noise)
    )


def _step_error(d: float, turn: float, h: float, this: Any, values: Any, slopes: Any) -> np.ndarray:
    """Odometry with an error of the turn rate; slopes are of GTSAM's local coordinates."""
    keys = this.keys()
    a, b = values.atPose2(keys[0]), values.atPose2(keys[1])
    constants = values.atVector(keys[2])
    turned = np.arctan2(np.sin(b.theta() - a.theta()), np.cos(b.theta() - a.theta()))
    middle = a.theta() + turned / 2
    c, s = np.cos(middle), np.sin(middle)
    dx, dy = b.x() - a.x(), b.y() - a.y()
    along, across = c * dx + s * dy, c * dy - s * dx
    if slopes is not None:
        world = np.array([[c, s, across / 2], [-s, c, -along / 2], [0.0, 0.0, 1.0]])
        before = -world
        before[:2, 2] = world[:2, 2]
        slopes[0], slopes[1] = before @ _turned(a), world @ _turned(b)
        slopes[2] = np.zeros((3, len(constants)))
        slopes[2][2, 0] = h
    return np.array([along - d, across, turned - turn + constants[0] * h])


def _range_error(
    anchor: int, point: np.ndarray, share: float, r: float, this: Any, values: Any, slopes: Any
) -> np.ndarray:
    """A range with scale and bias, its place between two poses."""
    keys = this.keys()
    a, b = values.atPose2(keys[0]), values.atPose2(keys[1])
    constants = values.atVector(keys[2])
    place = np.array([a.x() + share * (b.x() - a.x()), a.y() + share * (b.y() - a.y())])
    away = float(np.linalg.norm(place - point))
    if slopes is not None:
        towards = np.append((1 + constants[1]) * (place - point) / away, 0.0)[None]
        slopes[0] = (1 - share) * towards @ _turned(a)
        slopes[1] = share * towards @ _turned(b)
        slopes[2] = np.zeros((1, len(constants)))
        slopes[2][0, 1], slopes[2][0, 2 + anchor] = away, 1.0
    return np.array([away * (1 + constants[1]) + constants[2 + anchor] - r])


def _turned(pose: Any) -> np.ndarray:
    """World coordinates of a small change in GTSAM's own, which are the pose's."""
    out = np.eye(3)
    out[:2, :2] = pose.rotation().matrix()
    return out


def _poses(values: Any, count: int) -> np.ndarray:
    poses = [values.atPose2(i) for i in range(count)]
    return np.array([(p.x(), p.y(), p.theta()) for p in poses])

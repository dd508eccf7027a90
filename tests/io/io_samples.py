"""A small body with all joint types, and random recordings of it."""

from __future__ import annotations

import numpy as np

from mocap_jax.body import Body
from mocap_jax.recording import (
    AxisCalibration,
    AxisNoise,
    Calibration,
    InertialStream,
    MagneticStream,
    NoiseFigures,
    RangeStream,
    Recording,
    RestHold,
    RootStream,
    SensorSpec,
    Setup,
    SourceOffset,
    TemperatureStream,
    Truth,
)
from mocap_jax.solution import Solution, Status
from mocap_jax.trajectory import Trajectory

XML = """<mujoco>
  <worldbody>
    <site name="anchor/door" pos="1 0 1"/>
    <body name="Pelvis" pos="0 0 1" quat="0.8 0.6 0 0">
      <freejoint name="root"/>
      <geom size="0.1" mass="10"/>
      <site name="pelvis" pos="0.05 0 0"/>
      <site name="source/belly" pos="0.1 0 0" quat="0.7 0 0.7 0"/>
      <body name="RightUpperLeg" pos="0 -0.1 -0.05" quat="0.9 0 0.3 0.1">
        <joint name="RightHip" type="ball"/>
        <geom size="0.1" mass="5"/>
        <site name="right_thigh" pos="0 0 -0.2"/>
        <body name="RightLowerLeg" pos="0 0.02 -0.4">
          <joint name="RightKnee" type="hinge" axis="0 1 0" pos="0 0 0"/>
          <geom size="0.1" mass="3"/>
          <site name="right_shank" pos="0 0 -0.2"/>
          <body name="RightFoot" pos="0 0 -0.4" quat="0.9 0.1 0 0.2">
            <joint name="RightAnkle_z" type="hinge" axis="0 0 1"/>
            <joint name="RightAnkle_x" type="hinge" axis="1 0 0"/>
            <geom size="0.05" mass="1"/>
            <body name="RightToe" pos="0.15 0 0"><geom size="0.03" mass="0.2"/></body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>"""

SENSORS = ("pelvis", "right_thigh", "right_shank")
START = 1_700_000_000_123_456_789


def random_poses(body: Body, rng: np.random.Generator, n: int) -> np.ndarray:
    """Random poses of any body: unit quaternions, other coordinates normal."""
    q = rng.normal(size=(n, body.nq))
    for index in body.topology.quat_index[0]:
        q[:, index] /= np.linalg.norm(q[:, index], axis=1, keepdims=True)
    return q


def unit(x: np.ndarray) -> np.ndarray:
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def random_inertial(rng: np.random.Generator, n: int, rate: float = 140.0) -> InertialStream:
    stream = InertialStream(
        time=0.003 + np.arange(n) / rate,
        accelerometer=rng.normal(size=(n, 3)) + [0, 0, 9.81],
        gyroscope=rng.normal(size=(n, 3)),
        orientation=unit(rng.normal(size=(n, 4))),
    )
    stream.accelerometer[n // 2] = np.nan
    stream.gyroscope[n // 3] = np.nan
    stream.gyroscope[n // 4, 1] = np.nan
    stream.orientation[::3] = np.nan
    return stream


def random_calibration() -> Calibration:
    """Applied, so that a recording with it is read back as it was written."""
    axes = AxisCalibration((0.1, -0.2, 1 / 3), (1.01, 0.99, 1.0), (1e-3, 2e-3, 3e-3), (1e-4,) * 3)
    return Calibration(
        accelerometer={SENSORS[0]: axes},
        gyroscope={SENSORS[1]: axes, SENSORS[0]: AxisCalibration()},
        source_offset={"source/belly": SourceOffset(0.0031, 0.0004)},
        accelerometer_noise={SENSORS[0]: AxisNoise((1e-3,) * 3, (0.0,) * 3, (1e-5, 0.0, 2e-5))},
        gyroscope_noise={SENSORS[0]: AxisNoise((1e-4,) * 3)},
        applied=True,
    )


def random_setup() -> Setup:
    return Setup(
        sensors=tuple(SensorSpec(s, s, 140.0) for s in SENSORS),
        sources=("source/belly",),
        pulse_interval=0.0075,
        noise=NoiseFigures(accelerometer=0.1 + 0.2),
        rest=RestHold(0.0, 2.0, {"RightKnee": (0.1,), "RightHip": (1.0, 0.0, 0.0, 0.0)}),
        score_from=3.5,
        calibration=random_calibration(),
        provenance={"profile": "paper", "seed": 3, "cut_off_hz": 1 / 3, "raw": False},
    )


def random_recording(body: Body, seed: int = 0, n: int = 400) -> Recording:
    rng = np.random.default_rng(seed)
    m = 2 * n
    return Recording(
        inertial={s: random_inertial(rng, n) for s in SENSORS},
        ranges=RangeStream(
            time=np.sort(rng.uniform(0, n / 140, m)),
            source=rng.integers(0, 2, m),
            receiver=rng.integers(0, 3, m),
            distance=rng.uniform(0.1, 2.0, m),
            confidence=rng.uniform(0, 1, m),
            source_names=("source/belly", "anchor/door", "source/never_heard"),
            receiver_names=SENSORS,
        ),
        root=RootStream(np.arange(n) / 140, rng.normal(size=(n, 3)), unit(rng.normal(size=(n, 4)))),
        magnetic={"pelvis": MagneticStream(np.arange(20) / 10, rng.normal(size=(20, 3)) * 1e-5)},
        temperature=TemperatureStream(np.array([0.5]), np.array([21.7])),
        truth=Truth(
            Trajectory(
                np.arange(n) / 120, random_poses(body, rng, n), rng.normal(size=(n, body.nv))
            ),
            XML,
            {"gyroscope_bias/pelvis": rng.normal(size=3), "speed": np.float64(343.2)},
        ),
        setup=random_setup(),
        body_xml=XML,
        start_utc_ns=START,
        subject="S. Übung",
    )


def random_solution(body: Body, seed: int = 0, n: int = 60) -> Solution:
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(n, body.nv, body.nv))
    return Solution(
        trajectory=Trajectory(
            1.25 + np.arange(n) / 120, random_poses(body, rng, n), rng.normal(size=(n, body.nv))
        ),
        body=body,
        status=Status.UNDETERMINED,
        method="optimise",
        setup=random_setup(),
        remarks=("The heading is free.", "Ümlaut"),
        covariance=half @ np.swapaxes(half, 1, 2),
        observed=("RightUpperLeg",),
        cost=(1 / 3, 0.25),
        iterations=2,
        seconds_solve=0.1,
        seconds_compile=2.5,
        statistics={"accelerometer/pelvis": {"rms": 1.02, "count": 40}, "root": {"rms": np.nan}},
        innovations={"range": {"squared": 41.5, "count": 40}},
        calibration={"gyroscope_bias/pelvis": rng.normal(size=3)},
        calibration_std={"gyroscope_bias/pelvis": np.array([1e-3, np.inf, 0.1])},
        options={"kinds": "AGD", "sigmas": (0.1, None), "smooth": True},
    )

"""Which sensors disagree with the rest, and in what."""

from __future__ import annotations

import dataclasses

import numpy as np

from mocap_jax.estimate.mounting.result import MountingCalibration, SensorMounting
from mocap_jax.initialise.mounting.limb_turns import believed

# A sensor whose misfit is above this, and so many times the median, disagrees [rad].
_MISFIT, _TIMES = np.deg2rad(15.0), 2.0
# A common heading is doubted where a joint says otherwise by more [rad], and deviations.
_HEADING, _DEVIATIONS = np.deg2rad(20.0), 3.0
# What two sensors say of one hinge, apart [rad].
_HINGE = np.deg2rad(25.0)


def with_doubts(result: MountingCalibration) -> MountingCalibration:
    """The calibration with what speaks against each sensor, in sentences."""
    misfits = np.array([s.misfit for s in result.sensors])
    median = float(np.nanmedian(misfits)) if np.isfinite(misfits).any() else np.nan
    own = {s.sensor: s.heading for s in result.sensors}
    common = len({round(h, 9) for h in own.values()}) == 1
    sensors = tuple(
        dataclasses.replace(
            s, doubts=tuple([*_of_misfit(s, median), *(_of_heading(s) if common else ()),
                             *_of_hinge(s, result), *_of_limb(s, result)])
        )
        for s in result.sensors
    )  # fmt: skip
    return dataclasses.replace(result, sensors=sensors)


def _of_misfit(sensor: SensorMounting, median: float) -> list[str]:
    if not sensor.misfit > max(_MISFIT, _TIMES * median):
        return []
    return [
        f"disagrees with the others by {np.rad2deg(sensor.misfit):.0f} deg (RMS; median of all "
        f"{np.rad2deg(median):.0f}): wrong segment, mounting, heading or pose?"
    ]


def _of_heading(sensor: SensorMounting) -> list[str]:
    joint = sensor.joint
    if joint is None or not joint.known:
        return []
    if abs(joint.angle) < max(_HEADING, _DEVIATIONS * joint.std):
        return []
    return [
        f"its heading is {np.rad2deg(abs(joint.angle)):.0f} +- {np.rad2deg(joint.std):.0f} deg "
        f"from that of {sensor.above}, as the acceleration of the joint between them shows it: "
        "headings are not common (valid: own), or one of the two is disturbed"
    ]


def _of_hinge(sensor: SensorMounting, result: MountingCalibration) -> list[str]:
    return [
        f"the axis of {limb.hinge.joint} is {np.rad2deg(limb.apart):.0f} deg elsewhere than "
        f"{limb.sensor} sees it: heading of one of the two wrong?"
        for limb in result.limbs
        if limb.below == sensor.sensor and limb.apart > max(_HINGE, 2 * limb.hinge.std)
    ]


def _of_limb(sensor: SensorMounting, result: MountingCalibration) -> list[str]:
    return [
        f"{limb.hinge.joint} bends about an axis that is "
        f"{np.rad2deg(abs(limb.angle + result.facing.angle)):.0f} deg from where the pose has it: "
        "facing, heading or pose wrong? Its limb is left as the pose says"
        for limb in result.limbs
        if limb.sensor == sensor.sensor and believed(limb, result.facing) is None
    ]

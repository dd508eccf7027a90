"""`MountingCalibration`: what a calibration found, per sensor, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.initialise.mounting import Facing, JointHeading, LimbTurn
from mocap_jax.recording import Recording


@dataclass(frozen=True)
class SensorMounting:
    """How one sensor sits, and its heading."""

    sensor: str
    segment: str
    R_segment_sensor: Float[np.ndarray, "3 3"]
    angle: float
    """From the nominal mounting (the body's site, or aligned with the segment) [rad]."""
    tilt_std: float
    """Of the mounting, but for turns about the vertical at rest [rad]."""
    heading: float
    """Turn of its measured orientations about the vertical [rad]."""
    heading_std: float
    """[rad]; of the mounting too, about the vertical at rest."""
    limb_turn: float
    """How far its limb was turned about the vertical, against the stated pose [rad]."""
    above: str | None
    """The sensor that its heading was compared with."""
    joint: JointHeading | None
    """What the acceleration of the joint between them says; None without motion or accelerations.
    Where headings are common its angle should be zero."""
    misfit: float = np.nan
    """RMS angle between measured and fitted orientation over the motion [rad]; NaN: not fitted."""
    doubts: tuple[str, ...] = ()
    """What speaks against it, in sentences."""


@dataclass(frozen=True)
class MountingCalibration:
    """Sensors placed on a body, their headings made one, and how sure all of it is."""

    recording: Recording
    """Orientations turned to one heading; the body with the sites; the rest hold declared."""
    body: Body
    """With a site for each sensor."""
    sensors: tuple[SensorMounting, ...]
    rest: tuple[float, float]
    """Start and end of the still interval [s]."""
    pose: Float[np.ndarray, "nq"]
    """In it: as stated, with the limbs turned as their hinges show."""
    facing: Facing
    """Turn of all orientations that makes the body face as in the pose."""
    limbs: tuple[LimbTurn, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def findings(self) -> tuple[str, ...]:
        """All doubts, with the sensors named."""
        return tuple(f"{s.sensor}: {text}" for s in self.sensors for text in s.doubts)

    def to_dict(self) -> dict[str, object]:
        """For JSON; angles in degrees where the key says so."""
        return {
            "rest_s": list(self.rest),
            "facing": {
                "angle_deg": _deg(self.facing.angle), "std_deg": _deg(self.facing.std),
                "source": self.facing.source,
            },
            "sensors": {s.sensor: _numbers(s) for s in self.sensors},
            "findings": list(self.findings),
            "remarks": list(self.remarks),
        }  # fmt: skip

    def __str__(self) -> str:
        start, end = self.rest
        lines = [
            f"at rest {start:.2f} to {end:.2f} s; facing: {_deg(self.facing.angle):+.1f} +- "
            f"{_deg(self.facing.std):.1f} deg ({self.facing.source})",
            f"{'sensor':16s} {'segment':14s} {'mounting':>14s} {'heading':>15s} {'limb':>6s} "
            f"{'joint misfit':>12s} {'of motion':>9s} {'misfit':>7s}",
            f"{'':16s} {'':14s} {'[deg]':>14s} {'[deg]':>15s} {'[deg]':>6s} {'[m/s^2]':>12s} "
            f"{'[m/s^2]':>9s} {'[deg]':>7s}",
        ]
        lines += [_row(s) for s in self.sensors]
        lines += [f"finding: {text}" for text in self.findings]
        return "\n".join([*lines, *(f"note: {text}" for text in self.remarks)])


def _row(s: SensorMounting) -> str:
    joint = "" if s.joint is None else f"{s.joint.misfit:12.2f} {s.joint.motion:9.2f}"
    misfit = "" if np.isnan(s.misfit) else f"{_deg(s.misfit):7.1f}"
    return (
        f"{s.sensor:16s} {s.segment:14s} {_deg(s.angle):7.1f} +- {_deg(s.tilt_std):3.0f} "
        f"{_deg(s.heading):+8.1f} +- {_deg(s.heading_std):3.0f} {_deg(s.limb_turn):+6.1f} "
        f"{joint:22s} {misfit}"
    ).rstrip()


def _numbers(s: SensorMounting) -> dict[str, object]:
    out: dict[str, object] = {
        "segment": s.segment,
        "R_segment_sensor": s.R_segment_sensor.tolist(),
        "mounting_deg": _deg(s.angle),
        "tilt_std_deg": _deg(s.tilt_std),
        "heading_deg": _deg(s.heading),
        "heading_std_deg": _deg(s.heading_std),
        "limb_turn_deg": _deg(s.limb_turn),
        "misfit_deg": None if np.isnan(s.misfit) else _deg(s.misfit),
        "doubts": list(s.doubts),
    }
    if s.joint is not None:
        out["joint"] = {
            "above": s.above,
            "heading_deg": _deg(s.joint.angle),
            "heading_std_deg": _deg(s.joint.std),
            "misfit_m_s2": s.joint.misfit,
            "motion_m_s2": s.joint.motion,
            "lever_arms_m": s.joint.lever_arms.tolist(),
        }
    return out


def _deg(angle: float) -> float:
    return float(np.rad2deg(angle))

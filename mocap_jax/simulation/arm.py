"""`simulate_arm`: what four anchors hear of one mobile on the wrist of a moving arm."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body
from mocap_jax.body.site_names import SOURCE_PREFIX
from mocap_jax.errors import InputError
from mocap_jax.motion.arm import (
    ABDUCTION,
    ELBOW,
    ROTATION,
    SHOULDER,
    WRIST_SITE,
    Shoulder,
    arm_body,
)
from mocap_jax.recording import (
    NoiseFigures,
    RangeStream,
    Recording,
    RestHold,
    RootStream,
    Setup,
    Truth,
)
from mocap_jax.signals.ultrasonic.air import speed_of_sound
from mocap_jax.simulation.arm_movement import ArmMovement, arm_poses
from mocap_jax.simulation.options import SimulationOptions
from mocap_jax.simulation.profiles import Profile
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.ranging import sample_ranges
from mocap_jax.simulation.rig import build_rig
from mocap_jax.simulation.spline import PoseSpline
from mocap_jax.simulation.suit import Anchor, Mounting, Suit
from mocap_jax.simulation.true_body import true_body
from mocap_jax.trajectory import Trajectory

Place = tuple[float, float, float]

# Knots of the true movement [Hz]: it has content up to 12 Hz.
_KNOTS = 200.0


def anchor_frame(
    width: float = 2.0, height: float = 1.5, *, aside: float = 0.3,
    centre: tuple[float, float] = (0.3, 1.1),
) -> dict[str, Place]:  # fmt: skip
    """Four anchors at the corners of a frame parallel to the sagittal plane, beside a right arm.

    Args:
        width: along x [m].
        height: along z [m].
        aside: distance from the arm's plane [m].
        centre: x and z of the frame's middle [m].
    """
    x, z = centre
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return {
        str(i + 1): (x + a * width / 2, -aside, z + b * height / 2)
        for i, (a, b) in enumerate(corners)
    }


@dataclass(frozen=True)
class ArmScene:
    """An arm, its anchors, and what errs how much."""

    anchors: Mapping[str, Place] = field(default_factory=anchor_frame, hash=False)
    """Positions by name [m]."""
    upper_arm: float = 0.30
    """[m]"""
    forearm: float = 0.25
    """[m]"""
    shoulder: Place = (0.0, 0.0, 1.3)
    """In the world [m]."""
    movement: ArmMovement = field(default_factory=ArmMovement)
    rate_hz: float = 50.0
    """Pulses of the mobile a second."""
    noise: float = 0.003
    """Of ranges [m]."""
    celsius: float = 20.0
    """Of the air."""
    thermometer: float = 0.0
    """Standard deviation of the anchors' thermometers [K]."""
    survey: float = 0.0
    """Standard deviation of the anchors' stated positions, per axis [m]."""
    outliers: float = 0.0
    """Share of ranges that are too long by 5 to 50 cm, and look as good as others."""

    def __post_init__(self) -> None:
        if not 0 <= self.outliers < 1:
            raise InputError(f"outliers={self.outliers:g}: a share is from 0 to below 1")
        if not self.rate_hz > 0 or not self.noise > 0:
            raise InputError(
                f"rate_hz={self.rate_hz:g}, noise={self.noise:g}: both must be above 0"
            )

    def body(self, *, kind: Shoulder = "planar", loose_mobile: bool = False) -> Body:
        """The arm as declared; with `loose_mobile` as it is simulated."""
        return arm_body(
            self.anchors, upper_arm=self.upper_arm, forearm=self.forearm, shoulder=self.shoulder,
            kind=kind, loose_mobile=loose_mobile,
        )  # fmt: skip


def simulate_arm(scene: ArmScene, seed: int = 0, *, kind: Shoulder = "planar") -> Recording:
    """Simulate one trial.

    The mobile sends a pulse `rate_hz` times a second, anchors hear it (directivity, occlusion and
    echoes by C MuJoCo's ray casting, as in `simulate`), and each turns time of flight into distance
    by its own thermometer. The shoulder's place is given as the root.

    Args:
        scene: arm, anchors, movement and errors.
        seed: of all randomness.
        kind: of shoulder that the recording declares (`declared` exchanges it).

    Returns:
        Ranges, the declared arm, and the truth: ball joint, elbow and the mobile's slides.
    """
    actual, suit = scene.body(kind="ball", loose_mobile=True), _suit(scene)
    profile = _profile(scene)
    actual, parameters = true_body(actual, suit, profile, seed)
    movement = scene.movement
    end = movement.hold + movement.seconds
    time = np.arange(int(np.ceil((end + 0.1) * _KNOTS)) + 1) / _KNOTS
    poses = arm_poses(movement, time, seed)
    root = np.tile([*scene.shoulder, 1.0, 0.0, 0.0, 0.0], (len(time), 1))
    rig = build_rig(actual, (), suit.source_sites, suit.listening_anchors)
    spline = PoseSpline(rig.topology, time, np.concatenate([root, poses], axis=1))
    options = SimulationOptions(
        pulse_interval_s=1 / scene.rate_hz, speed_of_sound=float(speed_of_sound(scene.celsius))
    )
    ranges, more = sample_ranges(rig, spline, suit, profile, options, seed)
    assert ranges is not None  # the wrist carries a source
    frames = np.arange(int(np.rint(ranges.time[-1] * scene.rate_hz)) + 1) / scene.rate_hz
    q, v, _ = spline.evaluate(frames)
    recording = Recording(
        inertial={},
        ranges=_with_outliers(ranges, scene.outliers, seed),
        root=RootStream(frames, q[:, :3], q[:, 3:7]),
        magnetic={},
        temperature=None,
        truth=Truth(Trajectory(frames, q, v), actual.xml, parameters | more),  # type: ignore[arg-type]
        setup=_setup(scene, suit, profile, options, seed),
        body_xml=None,
        subject="arm",
    )
    return declared(recording, scene, kind)


def declared(recording: Recording, scene: ArmScene, kind: Shoulder) -> Recording:
    """The recording with another kind of shoulder declared, and the arm's start pose."""
    assert recording.truth is not None
    first = np.asarray(recording.truth.trajectory.q)[0]
    angle = np.deg2rad(scene.movement.shoulder_deg[0])
    ball = tuple(Rotation.from_euler("y", -angle).as_quat(scalar_first=True).tolist())
    pose = {
        "root": tuple(first[:7].tolist()),
        SHOULDER: ball if kind == "ball" else (float(angle),),
        ELBOW: (float(np.deg2rad(scene.movement.elbow_deg[0])),),
    }
    if kind == "sagittal":
        pose |= {ABDUCTION: (0.0,), ROTATION: (0.0,)}
    setup = dataclasses.replace(recording.setup, rest=RestHold(0.0, scene.movement.hold, pose))
    return dataclasses.replace(recording, setup=setup, body_xml=scene.body(kind=kind).xml)


def _suit(scene: ArmScene) -> Suit:
    """The devices, whose sites the arm has already."""
    wrist = Mounting(WRIST_SITE.removeprefix(SOURCE_PREFIX), "RightHand", (0.0, 0.0, 0.0))
    return Suit((), (wrist,), (), tuple(Anchor(n, p) for n, p in scene.anchors.items()))


def _profile(scene: ArmScene) -> Profile:
    # The shoulder's place is taken as known; a sigma is needed all the same.
    stated = NoiseFigures(range=scene.noise, root_position=1e-4, root_orientation=1e-4)
    return Profile(
        "arm", stated, anchor_temperature=scene.thermometer, anchor_position=scene.survey
    )


def _setup(
    scene: ArmScene, suit: Suit, profile: Profile, options: SimulationOptions, seed: int
) -> Setup:
    return Setup(
        sources=suit.source_sites,
        pulse_interval=options.pulse_interval_s,
        speed_of_sound=options.speed_of_sound,
        noise=profile.stated,
        score_from=scene.movement.hold + 1.0,
        provenance={"simulated": True, "motion": "arm flexion", "profile": "arm", "seed": seed},
    )


def _with_outliers(ranges: RangeStream, share: float, seed: int) -> RangeStream:
    """Some ranges replaced by late arrivals that nothing gives away."""
    rng = stream(seed, "arm/outliers")
    late: Float[np.ndarray, "n"] = rng.uniform(0.05, 0.5, len(ranges.time))
    hit = rng.random(len(ranges.time)) < share
    return dataclasses.replace(
        ranges,
        distance=np.asarray(ranges.distance) + np.where(hit, late, 0.0),
        confidence=np.where(hit, 1.0, np.asarray(ranges.confidence)),
    )  # type: ignore[arg-type]

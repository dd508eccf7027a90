"""`simulate`: a known motion to a recording with its truth."""

from __future__ import annotations

from mocap_jax.motion import Motion
from mocap_jax.recording import Calibration, Recording, uncalibrated
from mocap_jax.simulation.inertial import sample_inertial, sample_times
from mocap_jax.simulation.magnetic import sample_magnetic
from mocap_jax.simulation.options import SimulationOptions
from mocap_jax.simulation.orientation import sample_orientations
from mocap_jax.simulation.profiles import Profile, profile_named
from mocap_jax.simulation.ranging import sample_ranges
from mocap_jax.simulation.root_pose import sample_root
from mocap_jax.simulation.stage import declared_setup, set_stage
from mocap_jax.simulation.suit import Suit


def simulate(
    motion: Motion,
    *,
    profile: str | Profile = "paper",
    seed: int = 0,
    suit: Suit | None = None,
    options: SimulationOptions | None = None,
    calibration: Calibration | None = None,
) -> Recording:
    """Simulate what a suit records while a body performs a known motion.

    A still rest hold and a smooth blend stand in front of the low-passed clip. The physics is C
    MuJoCo's (sensors, kinematics, ray casting); no measurement model of the estimators is used.

    Args:
        motion: clip and body, with a free root.
        profile: `ideal` (no noise), `paper` (white noise) or `field` (all that goes wrong), or a
            `simulation.Profile` of your own.
        seed: of all randomness; the same seed gives the same recording.
        suit: boards and sources; default the standard suit fitted to the body.
        options: durations, rates, cut-off; default `SimulationOptions()`.
        calibration: what the suit's sensors are known to err by, besides the profile's errors; it
            is declared in the set-up, and the readings are those before `calibrated`.

    Returns:
        Measured streams, declared set-up with the nominal body, and the truth.

    Raises:
        InputError: unknown profile, unusable motion, or a suit that does not fit the body.
    """
    options = SimulationOptions() if options is None else options
    errs = profile if isinstance(profile, Profile) else profile_named(profile)
    stage = set_stage(motion, errs, seed, suit, options)
    rig, spline, suit, performance = stage.rig, stage.spline, stage.suit, stage.performance
    boards = stage.boards
    time = sample_times(stage.duration, options.inertial_rate_hz)
    turned: tuple[dict, dict] = ({}, {})
    if options.orientations:
        turned = sample_orientations(rig, spline, boards, time, errs, seed)
    inertial, more = (
        sample_inertial(rig, spline, boards, time, errs, seed, turned[0]) if boards else ({}, {})
    )
    magnetic: tuple[dict, dict] = ({}, {})
    if options.magnetic_field is not None:
        magnetic = sample_magnetic(rig, spline, boards, time, options.magnetic_field, errs, seed)
    ranges, speeds = sample_ranges(rig, spline, suit, errs, options, seed)
    truth, q = stage.truth(time, more | speeds | turned[1] | magnetic[1])
    setup = declared_setup(motion, suit, performance, errs, options, seed, calibration)
    recording = Recording(
        inertial=inertial,
        ranges=ranges,
        root=sample_root(time, q, errs, seed),
        magnetic=magnetic[0],
        temperature=None,
        truth=truth,
        setup=setup,
        body_xml=stage.nominal.xml,
        start_utc_ns=options.start_utc_ns,
        subject=motion.name,
    )
    return uncalibrated(recording)

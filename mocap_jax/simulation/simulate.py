"""`simulate`: a known motion to a recording with its truth."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion import Motion
from mocap_jax.recording import Recording, SensorSpec, Setup, Truth
from mocap_jax.simulation.default_suit import default_suit
from mocap_jax.simulation.inertial import sample_inertial, sample_times
from mocap_jax.simulation.magnetic import sample_magnetic
from mocap_jax.simulation.mounting import mount, with_shapes
from mocap_jax.simulation.options import SimulationOptions
from mocap_jax.simulation.orientation import sample_orientations
from mocap_jax.simulation.profiles import Profile, profile_named
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.ranging import sample_ranges
from mocap_jax.simulation.rest_hold import Performance, perform
from mocap_jax.simulation.rig import Rig, build_rig
from mocap_jax.simulation.root_pose import sample_root
from mocap_jax.simulation.soft_tissue import wobble
from mocap_jax.simulation.spline import PoseSpline
from mocap_jax.simulation.suit import Suit
from mocap_jax.simulation.true_body import true_body
from mocap_jax.trajectory import Trajectory


def simulate(
    motion: Motion,
    *,
    profile: str | Profile = "paper",
    seed: int = 0,
    suit: Suit | None = None,
    options: SimulationOptions | None = None,
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

    Returns:
        Measured streams, declared set-up with the nominal body, and the truth.

    Raises:
        InputError: unknown profile, unusable motion, or a suit that does not fit the body.
    """
    options = SimulationOptions() if options is None else options
    errs = profile if isinstance(profile, Profile) else profile_named(profile)
    if int(seed) != seed or seed < 0:
        raise InputError(f"seed {seed}: must be a whole number, 0 or more")
    nominal, suit = _dressed(motion.body, suit)
    actual, parameters = true_body(nominal, suit, errs, seed)
    pose_error = _pose_error(nominal, errs, seed)
    performance = perform(motion, options, pose_error)
    rig, spline = _worn(actual, suit, performance, errs, seed)
    boards = tuple(b.name for b in suit.boards)
    time = sample_times(float(performance.time[-1]), options.inertial_rate_hz)
    turned: tuple[dict, dict] = ({}, {})
    if options.orientations:
        turned = sample_orientations(rig, spline, boards, time, errs, seed)
    inertial, more = sample_inertial(rig, spline, boards, time, errs, seed, turned[0])
    magnetic: tuple[dict, dict] = ({}, {})
    if options.magnetic_field is not None:
        magnetic = sample_magnetic(rig, spline, boards, time, options.magnetic_field, errs, seed)
    ranges, speeds = sample_ranges(rig, spline, suit, errs, options, seed)
    q, v, _ = performance.spline(actual.topology).evaluate(time)
    parameters |= more | speeds | turned[1] | magnetic[1] | {"rest_pose_error": pose_error}
    truth = Truth(
        Trajectory(jnp.asarray(time), jnp.asarray(q), jnp.asarray(v)),
        actual.xml,
        {name: jnp.asarray(value) for name, value in parameters.items()},
    )
    return Recording(
        inertial=inertial,
        ranges=ranges,
        root=sample_root(time, q, errs, seed),
        magnetic=magnetic[0],
        temperature=None,
        truth=truth,
        setup=_setup(motion, suit, performance, errs, options, seed),
        body_xml=nominal.xml,
        start_utc_ns=options.start_utc_ns,
        subject=motion.name,
    )


def _dressed(body: Body, suit: Suit | None) -> tuple[Body, Suit]:
    """The nominal body with its suit on."""
    bare = with_shapes(body)
    suit = default_suit(bare) if suit is None else suit
    if not suit.boards:
        raise InputError("the suit has no boards; at least one is needed")
    return mount(bare, suit), suit


def _pose_error(body: Body, profile: Profile, seed: int) -> np.ndarray:
    """What the held pose differs from the declared one by, within the joints' ranges [rad]."""
    topology = body.topology
    error = profile.rest_pose * stream(seed, "rest_pose").standard_normal(topology.nv)
    ranges, reference = np.asarray(body.joint_range), np.asarray(body.qpos0)
    for j, kind in enumerate(topology.joint_types):
        dof = topology.joint_dof[j]
        if kind == "free":
            error[dof : dof + 6] = 0.0
        elif kind == "slide":
            error[dof] = 0.0
        elif kind == "hinge":
            lowest, highest = ranges[j] - reference[topology.joint_qpos[j]]
            # A reference pose outside the range (T-poses of some models) stays as it is.
            error[dof] = np.clip(error[dof], min(lowest, 0.0), max(highest, 0.0))
    return error


def _worn(
    body: Body, suit: Suit, performance: Performance, profile: Profile, seed: int
) -> tuple[Rig, PoseSpline]:
    """The rig and its motion; on soft tissue, boards move on their segments."""
    boards = tuple(b.name for b in suit.boards)
    rig = build_rig(body, boards, suit.source_sites)
    spline = PoseSpline(rig.topology, performance.time, performance.q)
    if not profile.tissue_frequency:
        return rig, spline
    loose = build_rig(body, boards, suit.source_sites, soft_tissue=True)
    q = np.zeros((len(performance.q), loose.model.nq))
    q[:, loose.coordinates] = performance.q
    q[:, loose.tissue_coordinates] = wobble(rig, spline, performance.time, boards, profile, seed)
    return loose, PoseSpline(loose.topology, performance.time, q)


def _setup(
    motion: Motion,
    suit: Suit,
    performance: Performance,
    profile: Profile,
    options: SimulationOptions,
    seed: int,
) -> Setup:
    """What the user of the suit would declare."""
    facts: dict[str, str | float | int | bool] = {
        **{f"motion_{key}": value for key, value in motion.facts.items()},
        "simulated": True,
        "motion": motion.name,
        "profile": profile.name,
        "seed": int(seed),
        "cutoff_hz": performance.cutoff_hz if np.isfinite(performance.cutoff_hz) else "none",
    }
    if performance.bridged_frames:
        facts["bridged_frames"] = performance.bridged_frames
    if suit.omitted:
        facts["suit_omitted"] = "; ".join(suit.omitted)
    rate = options.inertial_rate_hz
    return Setup(
        sensors=tuple(SensorSpec(b.name, b.name, rate) for b in suit.boards),
        sources=suit.source_sites,
        pulse_interval=options.pulse_interval_s,
        speed_of_sound=options.speed_of_sound,
        noise=profile.stated,
        rest=performance.rest,
        score_from=performance.score_from,
        provenance=facts,
    )

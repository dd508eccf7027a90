"""What a simulation has before a sensor is read: bodies, suit, performance and rig."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion import Motion
from mocap_jax.recording import Calibration, SensorSpec, Setup, Truth
from mocap_jax.simulation.default_suit import default_suit
from mocap_jax.simulation.mounting import mount, with_shapes
from mocap_jax.simulation.options import SimulationOptions
from mocap_jax.simulation.profiles import Profile
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.rest_hold import Performance, perform
from mocap_jax.simulation.rig import Rig, build_rig
from mocap_jax.simulation.soft_tissue import wobble
from mocap_jax.simulation.spline import PoseSpline
from mocap_jax.simulation.suit import Suit
from mocap_jax.simulation.true_body import true_body
from mocap_jax.trajectory import Trajectory


@dataclass(frozen=True)
class Stage:
    """The performance, set up."""

    nominal: Body
    """As declared, with the suit on."""
    actual: Body
    """As it really is."""
    suit: Suit
    performance: Performance
    rig: Rig
    spline: PoseSpline
    """Motion of the rig's model."""
    parameters: dict[str, np.ndarray]
    """True nuisance values so far."""

    @property
    def boards(self) -> tuple[str, ...]:
        """Names of the boards."""
        return tuple(b.name for b in self.suit.boards)

    @property
    def duration(self) -> float:
        """Length of the performance [s]."""
        return float(self.performance.time[-1])

    def truth(
        self, time: Float[np.ndarray, "n"], parameters: dict[str, np.ndarray]
    ) -> tuple[Truth, Float[np.ndarray, "n nq"]]:
        """The truth at the given times [s] with further parameters, and its coordinates."""
        q, v, _ = self.performance.spline(self.actual.topology).evaluate(time)
        every = {name: jnp.asarray(x) for name, x in (self.parameters | parameters).items()}
        trajectory = Trajectory(jnp.asarray(time), jnp.asarray(q), jnp.asarray(v))
        return Truth(trajectory, self.actual.xml, every), q


def set_stage(
    motion: Motion, profile: Profile, seed: int, suit: Suit | None, options: SimulationOptions
) -> Stage:
    """Prepare a performance (see `simulate` for the arguments).

    Raises:
        InputError: wrong seed, unusable motion, or a suit that does not fit the body.
    """
    if int(seed) != seed or seed < 0:
        raise InputError(f"seed {seed}: must be a whole number, 0 or more")
    nominal, suit = _dressed(motion.body, suit)
    actual, parameters = true_body(nominal, suit, profile, seed)
    pose_error = _pose_error(nominal, profile, seed)
    performance = perform(motion, options, pose_error)
    rig, spline = _worn(actual, suit, performance, profile, seed)
    parameters = parameters | {"rest_pose_error": pose_error}
    return Stage(nominal, actual, suit, performance, rig, spline, parameters)


def _dressed(body: Body, suit: Suit | None) -> tuple[Body, Suit]:
    """The nominal body with its suit on."""
    bare = with_shapes(body)
    suit = default_suit(bare) if suit is None else suit
    if not suit.boards and not (suit.source_sites and suit.receiver_names):
        raise InputError(
            "the suit has no boards; at least one is needed, or a source and an anchor that hears "
            "it"
        )
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
    rig = build_rig(body, boards, suit.source_sites, suit.listening_anchors)
    spline = PoseSpline(rig.topology, performance.time, performance.q)
    if not profile.tissue_frequency:
        return rig, spline
    loose = build_rig(body, boards, suit.source_sites, suit.listening_anchors, soft_tissue=True)
    q = np.zeros((len(performance.q), loose.model.nq))
    q[:, loose.coordinates] = performance.q
    q[:, loose.tissue_coordinates] = wobble(rig, spline, performance.time, boards, profile, seed)
    return loose, PoseSpline(loose.topology, performance.time, q)


def declared_setup(
    motion: Motion,
    suit: Suit,
    performance: Performance,
    profile: Profile,
    options: SimulationOptions,
    seed: int,
    calibration: Calibration | None,
) -> Setup:
    """What the user of the suit would declare, for readings that its calibration has corrected."""
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
    if len(set(suit.frequencies)) > 1:
        facts["source_frequencies_hz"] = ", ".join(f"{f:g}" for f in suit.frequencies)
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
        calibration=replace(calibration or Calibration(), applied=calibration is not None),
        provenance=facts,
    )

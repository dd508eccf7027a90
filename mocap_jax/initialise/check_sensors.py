"""`check_sensors`: swapped sensors, wrong units and turned boards, before anything is estimated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mocap_jax.body import Body, load_body
from mocap_jax.errors import InputError
from mocap_jax.initialise.neighbour_check import cycles
from mocap_jax.initialise.quaternion_order import misread_boards, misread_root
from mocap_jax.initialise.reading_series import series_of
from mocap_jax.initialise.rest_options import RestOptions
from mocap_jax.initialise.sensor_assignment import (
    TURNED,
    Assignment,
    Costs,
    assignment_costs,
    exchanged,
    tilts,
)
from mocap_jax.initialise.sensor_check import SensorCheck
from mocap_jax.initialise.sensor_evidence import Evidence, gather_evidence, world_rates
from mocap_jax.initialise.sensor_units import gravity_faults, rate_factors
from mocap_jax.initialise.still import find_still
from mocap_jax.initialise.unit_faults import unit_faults
from mocap_jax.recording import Recording

# Tilt beyond which a board counts as upside down or of reversed sign [rad].
_REVERSED = np.deg2rad(140.0)
# Mean error of a sensor's distances at rest that no pose explains [m].
_FAR = 0.3
# A gyroscope that never departs from its mean at rest by more has no signal [rad/s].
_DEAD = 1e-6
_UNRESTED = (
    "Sensors were not compared with the body's pose nor with each other: no rest hold is declared, "
    "and the start is not still."
)


def check_sensors(
    recording: Recording,
    body: Body | None = None,
    *,
    options: RestOptions = RestOptions(),  # noqa: B008  (frozen)
) -> SensorCheck:
    """Look for sensors that are swapped, turned, or read in wrong units.

    Compares, at the rest hold, gravity in every sensor and its distances from the ultrasonic
    sources with the declared pose and nominal mounting, and in the motion after it every gyroscope
    with its own accelerometer and with the sensors on neighbouring segments, measured orientations
    with both: quaternions of another order are named. Mounting and pose
    errors of a few degrees a joint, lengths wrong by a few per cent and places wrong by
    centimetres are normal and not reported. What cannot show in the readings is not found: a board
    turned about the vertical at rest, a gyroscope's sign on a segment that hardly turns. Where the
    start moves, units of accelerometers, those of gyroscopes after a later rest, and orders of
    quaternions are all that is looked for.

    Args:
        recording: measured streams and their set-up.
        body: nominal body whose sites carry the sensors; default the recording's own.
        options: how to find a rest where none is declared.

    Raises:
        InputError: no body, a sensor without a site, or a declared pose that does not fit.
    """
    if body is None:
        if recording.body_xml is None:
            raise InputError("the recording has no body model (attachment body.xml); give one")
        body = load_body(recording.body_xml)
    if not recording.inertial:
        return SensorCheck({}, remarks=("No inertial sensors to check.",))
    still = find_still(recording, options)
    if not still.still:
        return _with_order(_moving(recording, body), recording, body)
    return _with_order(_checked(gather_evidence(recording, body, still), body), recording, body)


def _moving(recording: Recording, body: Body) -> SensorCheck:
    """What shows without a rest at the start: units and orders of quaternions."""
    series = {name: series_of(stream) for name, stream in recording.inertial.items()}
    with np.errstate(invalid="ignore", divide="ignore"):
        found = unit_faults(recording, series, float(np.linalg.norm(np.asarray(body.gravity))))
    faults = {n: tuple(texts) for n, texts in found.faults.items()}
    check = SensorCheck(faults, (), found.measures, (_UNRESTED, *found.remarks))
    return _with_order(check, recording, body)


def _with_order(check: SensorCheck, recording: Recording, body: Body) -> SensorCheck:
    """Adds orders of quaternions that the other readings contradict, where these are sound."""
    x, y, z = np.asarray(body.gravity)
    if not -z > 1.0 + abs(x) + abs(y):  # without gravity nothing says where up is
        return check
    sound = [name for name, texts in check.findings.items() if not texts]
    boards = misread_boards(recording, sound)
    faults = check.faults | {n: (*check.faults[n], text) for n, text in boards.items()}
    return replace(check, faults=faults, root=misread_root(recording, body, sound))


def _checked(evidence: Evidence, body: Body) -> SensorCheck:
    with np.errstate(invalid="ignore", divide="ignore"):
        factor, wrong_rate, misfit = rate_factors(evidence)
        wrong_gravity, tilt = gravity_faults(evidence), tilts(evidence)
        reliable = np.array([w is None for w in wrong_rate]) | (factor != 1.0)
        # Inertial data in doubt themselves are no evidence that they were exchanged.
        plain = not any(wrong_rate) and not any(wrong_gravity)
        costs = assignment_costs(evidence, world_rates(evidence, factor), body.topology)
        silent = ~(np.abs(evidence.rate) > _DEAD).any((1, 2))
        costs = costs.without_motion_of(silent)
        # Costs with and without motion do not compare: one silent board stays where it is.
        reliable &= ~silent | silent.all()
        worn, heard = _assignment(costs, tilt, reliable, evidence.declared, plain)
    site, heard_site = np.argsort(worn), np.argsort(heard)
    faults: dict[str, tuple[str, ...]] = {}
    for i, name in enumerate(evidence.sensors):
        texts = (wrong_gravity[i], wrong_rate[i], _turned(tilt[i, site[i]], evidence.declared),
                 _far(evidence, i, int(heard_site[i])))  # fmt: skip
        faults[name] = tuple(t for t in texts if t is not None)
    groups, heard_groups = cycles(site), cycles(heard_site)
    stay = lambda group, at: all(at[i] == i for i in group)  # noqa: E731
    groups += [group for group in heard_groups if stay(group, site)]
    named = lambda group: tuple(evidence.sensors[i] for i in group)  # noqa: E731
    undeclared = "No rest pose is declared: sensors were compared with the body's reference pose."
    return SensorCheck(
        faults,
        tuple(map(named, groups)),
        _measures(evidence, np.diagonal(tilt), misfit),
        () if evidence.declared else (undeclared,),
        tuple(named(group) for group in groups if stay(group, heard)),
        tuple(named(group) for group in groups if stay(group, site)),
    )


def _assignment(
    costs: Costs, tilt: np.ndarray, reliable: np.ndarray, declared: bool, plain: bool
) -> Assignment:
    """Sensor at each site; boards that are turned in place do not speak for their neighbours."""
    costs = costs.without_motion_of(~reliable)
    found = exchanged(costs, tilt, reliable, parts=plain)
    worn = found.worn
    turned = tilt[worn, np.arange(len(worn))] > _turn_limit(declared)
    if not turned.any():
        return found
    still_reliable = reliable & ~np.isin(np.arange(len(worn)), worn[turned])
    costs = costs.without_motion_of(~still_reliable)
    return exchanged(costs, tilt, still_reliable, parts=plain)


def _turn_limit(declared: bool) -> float:
    return TURNED if declared else 2 * TURNED


def _turned(tilt: float, declared: bool) -> str | None:
    """Gravity at rest is far from where the declared pose and mounting put it."""
    if not tilt > _turn_limit(declared):
        return None
    guess = (
        "board upside down, or sign of the accelerometer reversed"
        if tilt > _REVERSED
        else "board turned on its segment, or axes exchanged"
    )
    return f"gravity at rest is {np.rad2deg(tilt):.0f} deg from where it should be ({guess})"


def _far(evidence: Evidence, sensor: int, site: int) -> str | None:
    """Distances at rest fit no pose near the declared one."""
    error = np.abs(evidence.distance[sensor] - evidence.expected[site])
    seen = error[np.isfinite(error)]
    if not evidence.declared or len(seen) < 2 or np.median(seen) < _FAR:
        return None
    return f"distances at rest are {100 * np.median(seen):.0f} cm off in the median"


def _measures(
    evidence: Evidence, tilt: np.ndarray, misfit: np.ndarray
) -> dict[str, dict[str, float]]:
    error = np.abs(evidence.distance - evidence.expected)
    out = {}
    for i, name in enumerate(evidence.sensors):
        seen = error[i][np.isfinite(error[i])]
        out[name] = {
            "gravity": float(np.linalg.norm(evidence.rest_force[i])),
            "tilt_deg": float(np.rad2deg(tilt[i])),
            "distance_error": float(seen.mean()) if len(seen) else float("nan"),
            "rate_misfit": float(misfit[i]),
        }
    return out

"""Low-pass filtering of pose sequences on the manifold."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.signal import butter, sosfiltfilt

from mocap_jax.body import Topology
from mocap_jax.errors import InputError

_ORDER = 4
# Stretch at either end of a clip that says how it would go on [s].
_END_FIT = 0.1
# Frames this close to a jump are bridged with it [s].
_BRIDGE_MARGIN = 0.1


def continuous_signs(quaternions: Float[np.ndarray, "t n 4"]) -> Float[np.ndarray, "t n 4"]:
    """Choose the sign of each quaternion so that neighbours in time lie on one hemisphere."""
    out = np.array(quaternions, float)
    if len(out) > 1:
        flips = np.where((out[1:] * out[:-1]).sum(axis=-1) < 0, -1.0, 1.0)
        out[1:] *= np.cumprod(flips, axis=0)[..., None]
    return out


def low_pass(
    topology: Topology, q: Float[np.ndarray, "t nq"], rate_hz: float, cutoff_hz: float
) -> tuple[Float[np.ndarray, "t nq"], float]:
    """Filter poses with a zero-phase Butterworth low-pass (no lag, no phase distortion).

    Interpolating unfiltered optical motion capture makes 4-14 m/s^2 of acceleration jitter.
    Hinge coordinates are unwrapped first. Quaternions are filtered as sign-continuous components
    and normalised again, which is exact to third order in the rotation within the filter's span
    and does not depend on a chart, so whole turns pass unharmed.

    Args:
        topology: joints of the body.
        q: uniformly sampled poses.
        rate_hz: sampling rate [Hz].
        cutoff_hz: half-power frequency [Hz].

    Returns:
        Filtered poses and the cut-off that was applied (infinite if the clip's own rate already
        limits its content below `cutoff_hz`).

    Raises:
        InputError: the cut-off is not positive or the clip is too short to filter.
    """
    if not cutoff_hz > 0:
        raise InputError(f"cutoff_hz {cutoff_hz:g}: must be above 0 Hz (12 is usual)")
    out = unwrap(topology, q)
    if cutoff_hz >= 0.499 * rate_hz:
        return out, float("inf")
    # Twice through (forwards, backwards) halves the power twice: widen so that the half-power
    # frequency of the whole is the one asked for (Winter 2009, section 3.4.4.2).
    # The tangents undo the frequency warping of the bilinear transform.
    ratio = (np.sqrt(2.0) - 1.0) ** (1.0 / (2 * _ORDER))
    widened = rate_hz / np.pi * np.arctan(np.tan(np.pi * cutoff_hz / rate_hz) / ratio)
    sections = butter(_ORDER, widened, fs=rate_hz, output="sos")
    # The end effect of the filter spans about three periods of the cut-off.
    padding = max(int(3 * rate_hz / cutoff_hz), 1)
    if len(out) < 4:
        raise InputError(f"motion of {len(out)} frames: at least 4 are needed to filter it")
    ends = max(int(_END_FIT * rate_hz), 4)
    head = _continued(out[:ends][::-1], padding)[::-1]
    tail = _continued(out[-ends:], padding)
    out = sosfiltfilt(sections, np.concatenate([head, out, tail]), axis=0, padlen=padding)
    out = out[padding:-padding]
    return normalise_rows(topology, out), cutoff_hz


def _continued(stretch: Float[np.ndarray, "n nq"], count: int) -> Float[np.ndarray, "count nq"]:
    """Carry the end of a stretch on along its fitted parabola.

    A mirrored extension, the usual one, has no acceleration at the end of the clip and would bend
    the motion there.
    """
    steps = np.arange(len(stretch)) - (len(stretch) - 1)
    fit = np.polynomial.polynomial.polyfit(steps, stretch, 2)
    return np.polynomial.polynomial.polyval(np.arange(1, count + 1), fit).T


def bridge_jumps(
    topology: Topology, q: Float[np.ndarray, "t nq"], rate_hz: float, fastest: float
) -> tuple[Float[np.ndarray, "t nq"], int]:
    """Replace stretches where a joint turns impossibly fast by interpolation across them.

    Optical clips hold swapped markers and flipped solutions: turns of radians within one frame,
    which would make thousands of m/s^2 at the sensors.

    Args:
        topology: joints of the body.
        q: uniformly sampled poses.
        rate_hz: sampling rate [Hz].
        fastest: largest believable speed of a joint [rad/s].

    Returns:
        Poses and the number of frames in which some joint was bridged.
    """
    out = unwrap(topology, q)
    margin = int(np.ceil(_BRIDGE_MARGIN * rate_hz))
    touched = np.zeros(len(out), bool)
    in_q, _ = topology.quat_index
    rotations = [list(i) for i in in_q] + [[i] for i in _hinges(topology)]
    for columns in rotations:
        # Chords of quaternions are half the angle to second order.
        step = np.linalg.norm(np.diff(out[:, columns], axis=0), axis=1) * (
            2.0 if len(columns) == 4 else 1.0
        )
        jumps = np.flatnonzero(step * rate_hz > fastest)
        if not jumps.size:
            continue
        bad = np.zeros(len(out), bool)
        for jump in jumps:
            bad[max(jump - margin, 0) : jump + margin + 2] = True
        good = np.flatnonzero(~bad)
        if len(good) < 2:
            continue
        # Two flips of nearly half a turn add up to a whole one that nobody made.
        out[good] = _same_turn(topology, out[good], columns)
        for column in columns:
            out[bad, column] = np.interp(np.flatnonzero(bad), good, out[good, column])
        touched |= bad
    return normalise_rows(topology, out), int(touched.sum())


def _same_turn(topology: Topology, q: np.ndarray, columns: list[int]) -> np.ndarray:
    """Poses with one joint's coordinates continuous (whole turns, signs) from row to row."""
    out = np.array(q)
    out[:, columns] = unwrap(topology, q)[:, columns]
    return out


def unwrap(topology: Topology, q: Float[np.ndarray, "t nq"]) -> Float[np.ndarray, "t nq"]:
    """Remove jumps of whole turns of hinges and of sign of quaternions."""
    out = np.array(q, float)
    hinges = _hinges(topology)
    if hinges:
        out[:, hinges] = np.unwrap(out[:, hinges], axis=0)
    in_q, _ = topology.quat_index
    if in_q.size:
        out[:, in_q] = continuous_signs(out[:, in_q])
    return out


def _hinges(topology: Topology) -> list[int]:
    """Indices of hinge coordinates in q."""
    kinds = enumerate(topology.joint_types)
    return [int(topology.joint_qpos[j]) for j, kind in kinds if kind == "hinge"]


def normalise_rows(topology: Topology, q: Float[np.ndarray, "t nq"]) -> Float[np.ndarray, "t nq"]:
    """Bring the quaternions of all poses to unit norm."""
    out = np.array(q, float)
    in_q, _ = topology.quat_index
    if in_q.size:
        out[:, in_q] /= np.linalg.norm(out[:, in_q], axis=-1, keepdims=True)
    return out

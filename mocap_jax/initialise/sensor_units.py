"""Units, scale and sign of accelerometers and gyroscopes, from their own readings."""

from __future__ import annotations

import numpy as np

from mocap_jax.initialise.sensor_evidence import RATE_HZ, Evidence, turns

# What readings in other units or of another sign must be multiplied by.
_RATE_FACTORS = {
    np.pi / 180: "reads in deg/s; rad/s is expected",
    180 / np.pi: "is 57 times too small (converted from deg/s to rad/s twice?)",
    2 * np.pi: "reads in turns per second; rad/s is expected",
    0.5: "reads twice the true rate (wrong full scale?)",
    2.0: "reads half the true rate (wrong full scale?)",
    -1.0: "has the opposite sign",
}
_FORCE_FACTORS = {
    9.80665: "reads in g; m/s^2 is expected",
    9.80665e-3: "reads in mg; m/s^2 is expected",
    1 / 9.80665: "is 9.8 times too large (converted from g to m/s^2 twice?)",
    2.0: "reads half of gravity (wrong full scale?)",
    0.5: "reads twice gravity (wrong full scale?)",
}
# Gravity may be off by this share (scale error and offset of consumer sensors: about 3 %).
_GRAVITY = 0.1
# A unit is named when gravity fits it this well.
_UNIT = 0.15
# A rate factor is named when it leaves less than this share of the misfit that 1 leaves.
_DECISIVE = 0.3
# Misfit [m/s^2] beyond which gyroscope and accelerometer disagree whatever the factor.
_DISAGREE = 4.5
# Factors are not judged below this misfit [m/s^2] and in shorter recordings [s].
_TELLING, _LEAST_SPAN = 1.5, 4.0
# Forces are averaged over windows of this length [s], in which a body accelerates little, and
# compared with the rest over this time, in which the integrated rate drifts little.
_WINDOW, _SPAN = 1.0, 12.0


def gravity_faults(evidence: Evidence) -> list[str | None]:
    """What is wrong with each accelerometer's reading of gravity at rest; None where it fits."""
    out: list[str | None] = []
    for norm in np.linalg.norm(evidence.rest_force, axis=1):
        ratio = norm / evidence.gravity if evidence.gravity > 1.0 else np.nan
        if not np.isfinite(ratio) or abs(ratio - 1) < _GRAVITY:
            out.append(None)
            continue
        unit = [s for k, s in _FORCE_FACTORS.items() if abs(ratio * k - 1) < _UNIT]
        guess = "gravity seems to be removed" if ratio < 0.05 else "wrong scale"
        out.append(
            f"accelerometer {unit[0] if unit else guess} "
            f"(gravity at rest reads {norm:.3g}, not {evidence.gravity:.2f})"
        )
    return out


def rate_factors(evidence: Evidence) -> tuple[np.ndarray, list[str | None], np.ndarray]:
    """Whether each gyroscope agrees with its own accelerometer.

    The specific force, turned back to the rest by the integrated rate and averaged over a second,
    is gravity again, as segments accelerate little in the mean. Wrong rates turn gravity away. Of
    a few likely factors the one that brings it back best is taken, if it is decisively better
    than 1 and the recording moves enough to tell.

    Returns:
        Factors for the readings (s,), what is wrong (None where nothing is), and the misfit
        of the readings as they are [m/s^2] (s,).
    """
    norm = np.linalg.norm(evidence.rest_force, axis=1)[:, None, None]
    rest = evidence.rest_force * evidence.gravity / norm[..., 0]
    steps = int(_SPAN * RATE_HZ)
    rate, force = evidence.rate[:, :steps], evidence.force[:, :steps] * evidence.gravity / norm
    factors = np.array([1.0, *_RATE_FACTORS])
    misfit = np.stack([_misfit(k * rate, force, rest) for k in factors])
    misfit[:, ~np.isfinite(evidence.rate).any((1, 2))] = np.nan
    best = np.argmin(np.where(np.isfinite(misfit), misfit, np.inf), axis=0)
    clear = misfit.min(axis=0) ** 2 < _DECISIVE * misfit[0] ** 2
    # Little motion turns gravity by little: any factor then fits by chance.
    clear &= (misfit[0] > _TELLING) & (rate.shape[1] >= _LEAST_SPAN * RATE_HZ)
    chosen = np.where(clear, factors[best], 1.0)
    sentences = [_rate_sentence(k, x) for k, x in zip(chosen, misfit[0], strict=True)]
    return chosen, sentences, misfit[0]


def rate_factor_near(factor: float) -> str | None:
    """What is wrong with a gyroscope whose readings need this factor; None near 1 or unclear."""
    for known, text in _RATE_FACTORS.items():
        if abs(factor / known - 1) < _UNIT:
            return text
    return None


def _rate_sentence(factor: float, misfit: float) -> str | None:
    if factor != 1.0:
        return f"gyroscope {_RATE_FACTORS[factor]}"
    if misfit > _DISAGREE:
        return (
            "gyroscope and accelerometer disagree: turned back by the gyroscope, gravity is "
            f"{misfit:.1f} m/s^2 off in the mean (axes exchanged between them, or no signal?)"
        )
    return None


def _misfit(rate: np.ndarray, force: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """RMS change [m/s^2] of turned-back forces, averaged over windows, from the one at rest."""
    window = int(_WINDOW * RATE_HZ)
    count = rate.shape[1] // window
    if not count:
        return np.full(len(rate), np.nan)
    rate = np.nan_to_num(rate[:, : count * window])
    turn, half = turns(rate / RATE_HZ), turns(0.5 * rate / RATE_HZ)
    R, turned = np.tile(np.eye(3), (len(rate), 1, 1)), np.empty(rate.shape)
    for k in range(count * window):
        # The force is the mean over the step: seen from its middle.
        turned[:, k] = (R @ half[:, k] @ force[:, k, :, None])[..., 0]
        R = R @ turn[:, k]
    means = turned.reshape(len(rate), count, window, 3).mean(axis=2)
    return np.sqrt(((means - rest[:, None]) ** 2).sum(-1).mean(axis=1))

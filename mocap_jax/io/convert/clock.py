"""Clocks of other systems: packet counters that wrap around, gaps, time that runs backwards."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from mocap_jax.errors import InputError

COUNTER_SIZE = 1 << 16
"""Packet counters have 16 bits."""
# Samples missing for each one there is, beyond which a counter is not believed.
_MOST_GAPS = 20


def unwrapped(counter: Int[np.ndarray, "n"], where: str, first_line: int) -> Int[np.ndarray, "n"]:
    """A packet counter without its wrap-arounds, from its own first value on.

    Args:
        counter: as recorded; values of 65536 and more mean that it does not wrap.
        where: file, for messages.
        first_line: line of the first value, for messages.

    Raises:
        InputError: the counter repeats or runs backwards.
    """
    step = np.diff(counter)
    if counter.max(initial=0) < COUNTER_SIZE:
        step = step % COUNTER_SIZE
        backwards = np.flatnonzero(step > COUNTER_SIZE // 2)
    else:
        backwards = np.flatnonzero(step < 0)
    for bad, what in ((backwards, "runs backwards"), (np.flatnonzero(step == 0), "repeats")):
        if bad.size:
            i = int(bad[0])
            raise InputError(
                f"{where}: line {first_line + i + 1}: the packet counter {what} "
                f"({counter[i]}, then {counter[i + 1]}; {bad.size} such places)"
            )
    return counter[0] + np.concatenate([[0], np.cumsum(step)])


def plausible_gaps(counter: Int[np.ndarray, "n"], where: str) -> None:
    """Refuse counters that skip most of what they count, which damaged digits do.

    Raises:
        InputError: naming the worst jump.
    """
    span = int(counter[-1] - counter[0]) + 1
    if span > COUNTER_SIZE + _MOST_GAPS * len(counter):
        i = int(np.argmax(np.diff(counter)))
        raise InputError(
            f"{where}: counts {span} samples but holds {len(counter)} (jumps from {counter[i]} to "
            f"{counter[i + 1]}: a damaged number?)"
        )


def on_one_clock(counters: list[np.ndarray], *, wraps: bool) -> list[np.ndarray]:
    """Unwrapped counters of several sensors counted from the earliest packet of all.

    Of sensors that start on different sides of a wrap-around, the difference of less than half a
    round is the true one.
    """
    reference = int(counters[0][0])
    out = []
    for counter in counters:
        offset = int(counter[0]) - reference
        if wraps:
            offset = (offset + COUNTER_SIZE // 2) % COUNTER_SIZE - COUNTER_SIZE // 2
        out.append(counter - counter[0] + offset)
    earliest = min(int(c[0]) for c in out)
    return [c - earliest for c in out]


def with_gaps(
    packets: Int[np.ndarray, "n"], values: Float[np.ndarray, "n k"] | None
) -> Float[np.ndarray, "m k"] | None:
    """Values on an even grid of packets, NaN where a packet is missing."""
    if values is None:
        return None
    out = np.full((int(packets[-1] - packets[0]) + 1, values.shape[1]), np.nan)
    out[packets - packets[0]] = values
    return out


def increasing(
    time: Float[np.ndarray, "n"], where: str, first_line: int | None = None
) -> Float[np.ndarray, "n"]:
    """The times themselves, if they are finite and strictly increase.

    Raises:
        InputError: naming the line (or sample) where they do not.
    """
    at = lambda i: f"line {first_line + i}" if first_line is not None else f"sample {i}"  # noqa: E731
    bad = np.flatnonzero(~np.isfinite(time))
    if bad.size:
        raise InputError(f"{where}: {at(int(bad[0]))}: the time is missing or not a number")
    step = np.diff(time)
    bad = np.flatnonzero(step <= 0)
    if bad.size:
        i = int(bad[0])
        what = "repeats" if step[i] == 0 else "runs backwards"
        raise InputError(
            f"{where}: {at(i + 1)}: time {what} ({time[i]:.6f}, then {time[i + 1]:.6f}; "
            f"{bad.size} such places)"
        )
    return time


def nominal_rate(time: Float[np.ndarray, "n"], given: float | None, where: str) -> float:
    """Sampling rate [Hz]: the one given, or that of the median step."""
    if given is not None:
        return given
    if len(time) < 2:
        raise InputError(f"{where}: one sample only; its sampling rate must be given")
    # To a millionth: steps of times in binary are not quite even.
    return float(f"{1.0 / np.median(np.diff(time)):.7g}")

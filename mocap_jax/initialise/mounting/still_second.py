"""The still interval that a calibration rests on: as asked for, or the stillest near the start."""

from __future__ import annotations

import numpy as np

from mocap_jax.errors import InputError
from mocap_jax.initialise.rest_options import RestOptions
from mocap_jax.initialise.still import find_still, rate_within
from mocap_jax.recording import Recording, in_gap

# Half of the interval around a time asked for, and the window and the search without one [s].
_HALF, _WINDOW, _SEARCH = 0.25, 1.0, 5.0
# RMS rate above which it does not count as still [rad/s]; a person who stands sways below it.
_STILL = 0.15


class NotStillError(InputError):
    """The moment that was asked for is no still one."""


def rest_interval(recording: Recording, time: float | None) -> tuple[float, float]:
    """Start and end of the still interval [s].

    Args:
        recording: with gyroscopes or orientations.
        time: a moment in it; default the declared rest hold, or else the stillest second in the
            first five.

    Raises:
        NotStillError: the time is outside the recording, nobody is still then, or nothing was
            measured.
        InputError: the same of the declared rest hold.
    """
    first, last = recording.interval
    what, rest = "", recording.setup.rest
    if time is not None:
        if not first <= time <= last:
            raise NotStillError(
                f"time {time:g} s is outside the recording; valid: {first:.2f} to {last:.2f} s"
            )
        start, end = max(time - _HALF, first), min(time + _HALF, last)
    elif rest is not None:
        start, end, what = rest.start, rest.end, "declared rest hold: "
        if start > last or end < first:
            raise InputError(
                f"the declared rest hold, {start:.2f} to {end:.2f} s, is outside the recording, "
                f"{first:.2f} to {last:.2f} s: give a time of a still second{_stillest(recording)}"
            )
    else:
        still = find_still(recording, RestOptions(search=_SEARCH, window=_WINDOW))
        start, end = still.start, min(still.end, last)
    fault = _fault(recording, start, end)
    if fault:
        error = InputError if time is None else NotStillError
        raise error(f"{what}{fault}: give a time of a still second{_stillest(recording)}")
    return start, end


def _fault(recording: Recording, start: float, end: float) -> str:
    """Why an interval tells no mounting; empty if it does, or no gyroscope says whether."""
    if in_gap(recording, start, end):
        return f"nothing was measured at {start:.2f} to {end:.2f} s"
    rate = rate_within(recording, start, end)
    if rate > _STILL and np.isfinite(rate):
        return (
            f"nobody is still at {start:.2f} to {end:.2f} s ({rate:.2f} rad/s, at most {_STILL:g})"
        )
    return ""


def _stillest(recording: Recording) -> str:
    first, last = recording.interval
    starts = np.arange(first, max(last - _WINDOW, first) + 1e-9, 0.5)
    rates = [rate_within(recording, s, s + _WINDOW) for s in starts]
    best = int(np.argmin(rates))
    if not np.isfinite(rates[best]):  # without gyroscopes nobody knows
        return ""
    if not rates[best] < _STILL:
        return "; this recording has none"
    return f"; the stillest is at {starts[best] + _WINDOW / 2:.1f} s"

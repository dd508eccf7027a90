"""A wire's telemetry from voltages to timed frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from mocap_jax.signals.telemetry.bit_clock import BitClock
from mocap_jax.signals.telemetry.decode import FrameDecoder, Frames, hard_bits, join
from mocap_jax.signals.telemetry.frame import BIT_RATE_HZ, FRAME_BITS, FRAME_RATE_HZ

# Readings of a block of two frames end where its bits begin, in the middle of the first bit less
# half a bit.
_BEFORE_S = (1.5 + 0.5 / FRAME_BITS) / FRAME_RATE_HZ


@dataclass(frozen=True)
class TimedFrames:
    """Frames and the centres of the intervals that their readings were taken in."""

    frames: Frames
    time: Float[np.ndarray, "n"]
    """[s]"""


class TelemetryReceiver:
    """Follows one wire; memory is bounded by two seconds of bits.

    Args:
        sample_rate_hz: of the voltages.
    """

    def __init__(self, sample_rate_hz: float) -> None:
        self._clock = BitClock(BIT_RATE_HZ, sample_rate_hz)
        self._decoder = FrameDecoder()
        self._time = np.zeros(0)
        self._first = 0
        self._parts: list[TimedFrames] = []

    def feed(self, voltage: Float[np.ndarray, "n"], start: float, spare: int) -> None:
        """Take the next block (see `BitClock.bits`)."""
        bits = self._clock.bits(voltage, start, spare)
        self._time = np.concatenate([self._time, bits.time])
        frames = self._decoder.feed(hard_bits(bits.values))
        if len(frames.bit):
            time = self._time[frames.bit - self._first] - _BEFORE_S
            self._parts.append(TimedFrames(_small(frames), time))
            self._drop(int(frames.bit[-1]))
        elif not self._decoder.locked:
            self._drop(self._first + max(0, len(self._time) - 2 * int(BIT_RATE_HZ)))

    def _drop(self, until: int) -> None:
        self._time, self._first = self._time[until - self._first :], until

    def frames(self) -> TimedFrames:
        """All frames so far."""
        time = [p.time for p in self._parts] or [np.zeros(0)]
        return TimedFrames(join([p.frames for p in self._parts]), np.concatenate(time))


def _small(frames: Frames) -> Frames:
    """The same in as few bytes as hold it."""
    tiny = lambda x: x.astype(np.int8)  # noqa: E731
    return Frames(
        frames.bit, tiny(frames.index), tiny(frames.codes), tiny(frames.level_bits),
        tiny(frames.corrected), frames.accepted,
    )  # fmt: skip

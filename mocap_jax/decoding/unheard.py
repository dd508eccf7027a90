"""Who is not heard: sources without distances, and anchors too far for the slots."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jax import device_put
from jax.typing import ArrayLike
from jaxtyping import Float, Int

from mocap_jax.body.site_names import ANCHOR_PREFIX
from mocap_jax.decoding.pulses import Pulses
from mocap_jax.recording import RangeStream

_GOOD, _OFTEN = 0.35, 0.05
"""An anchor is near enough if this share of the pulses has a confidence above this: boards that are
hidden, and times when all are far, do not outvote those that hear. What comes from beyond a slot is
too faint for the place that it seems to have: 1 % of its pulses has such a confidence."""
_FAINT = 0.15
"""Mean confidence of an anchor's distances below which it is too far otherwise. Of what comes from
beyond a slot it is a tenth of this or a fifth."""
_RARE = 0.02
"""Sum of confidences over the pulses below which an anchor or a worn source is not heard: silence
has 0.003, since one in a hundred slots of noise has a peak of 4 noise amplitudes."""


def without_faint_anchors(
    ranges: RangeStream, pulses: Pulses
) -> tuple[RangeStream, tuple[str, ...]]:
    """The distances but for those of anchors of which hardly any is to be trusted; their names.

    No body bounds distances to anchors, so that what is wrong there is not too long for it. The
    few that pass for good ones would tie a free root to a wrong place.

    Args:
        ranges: of all pairs.
        pulses: all emissions.
    """
    counts = _counts(ranges, pulses)
    sources = {
        name for s, name in enumerate(ranges.source_names)
        if name.startswith(ANCHOR_PREFIX) and _is_faint(*_of(ranges.source, ranges, s), counts[s])
    }  # fmt: skip
    receivers = {
        name for r, name in enumerate(ranges.receiver_names)
        if name.startswith(ANCHOR_PREFIX)
        and _is_faint(*_of(ranges.receiver, ranges, r), counts.sum())
    }  # fmt: skip
    away = [np.isin(index, [i for i, name in enumerate(names) if name in faint])
            for index, names, faint in (
                (ranges.source, ranges.source_names, sources),
                (ranges.receiver, ranges.receiver_names, receivers))]  # fmt: skip
    kept = ~(away[0] | away[1])
    columns = ("time", "source", "receiver", "distance", "confidence")
    rest = {c: device_put(np.asarray(getattr(ranges, c))[kept]) for c in columns}
    return replace(ranges, **rest), (*sorted(sources), *sorted(receivers))


def sentences(
    ranges: RangeStream,
    pulses: Pulses,
    faint: tuple[str, ...],
    interval: float,
    farthest: float,
) -> tuple[str, ...]:
    """Which worn sources are not heard, and which anchors were left out.

    (A board may well hear nothing: that of the head is above all sources of the standard suit.)

    Args:
        ranges: of all pairs.
        pulses: all emissions.
        faint: anchors left out.
        interval: between pulses of one frequency [s].
        farthest: longest distance that is looked for [m].
    """
    counts = _counts(ranges, pulses)
    dead = [
        name for s, name in enumerate(ranges.source_names)
        if not name.startswith(ANCHOR_PREFIX)
        and _of(ranges.source, ranges, s)[0].sum() < _RARE * counts[s]
    ]  # fmt: skip
    out = [f"no wire hears {', '.join(dead)}"] if dead else []
    if faint:
        out.append(
            f"{', '.join(faint)}: too faint, left out (slots of {1e3 * interval:g} ms hear "
            f"{farthest:.3g} m)"
        )
    return tuple(out)


def _counts(ranges: RangeStream, pulses: Pulses) -> np.ndarray:
    """Pulses of each source."""
    index, _ = pulses.sources(ranges.source_names)
    return np.bincount(index, minlength=len(ranges.source_names))


def _is_faint(confidence: Float[np.ndarray, "k"], pulse: Int[np.ndarray, "k"], pulses: int) -> bool:
    """Whether an anchor is too far.

    Args:
        confidence: of its distances.
        pulse: which pulse each is of.
        pulses: number of those that could have been heard.
    """
    if not pulses or len(np.unique(pulse[confidence > _GOOD])) >= _OFTEN * pulses:
        return False
    return bool(confidence.mean() < _FAINT or confidence.sum() < _RARE * pulses)


def _of(
    index: ArrayLike, ranges: RangeStream, which: int
) -> tuple[Float[np.ndarray, "k"], Int[np.ndarray, "k"]]:
    """Confidences of the distances of one source or receiver, and their pulses.

    Sources of several frequencies sound at the same time: a pulse is a time and a source. Where
    there are no distances, there is one of confidence 0.
    """
    own = np.asarray(index) == which
    if not own.any():
        return np.zeros(1), np.zeros(1, int)
    named = np.stack([np.asarray(ranges.time)[own], np.asarray(ranges.source)[own]], axis=1)
    pulse = np.unique(named, axis=0, return_inverse=True)[1]
    return np.asarray(ranges.confidence)[own], pulse.reshape(-1)

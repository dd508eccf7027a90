"""Distances that the wearer's body allows: longer ones are reflections."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body, load_body, reach
from mocap_jax.recording import Recording

_SHARE, _MARGIN = 1.05, 0.03
"""What the nominal body's lengths and the places of its devices may be wrong by [1, m]."""


def longest_distances(
    recording: Recording, sources: tuple[str, ...], receivers: tuple[str, ...]
) -> Float[np.ndarray, "s r"]:
    """Longest plausible distance of each pair [m]; infinity where the body sets no bound.

    Args:
        recording: with body and set-up; without a body nothing is bounded.
        sources: site names.
        receivers: sensor names.
    """
    body = load_body(recording.body_xml) if recording.body_xml else None
    site_of = {sensor.name: sensor.site for sensor in recording.setup.sensors}
    return np.array(
        [[_longest(body, s, site_of.get(r, r)) for r in receivers] for s in sources], np.float64
    ).reshape(len(sources), len(receivers))


def _longest(body: Body | None, source: str, receiver: str) -> float:
    names = body.topology.site_names if body is not None else ()
    if body is None or source not in names or receiver not in names:
        return float("inf")
    return _SHARE * reach(body, names.index(source), names.index(receiver)) + _MARGIN

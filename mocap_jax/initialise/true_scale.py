"""How much larger the segments of the true body are than those of a nominal one."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.errors import InputError
from mocap_jax.motion import segment_lengths, segment_tip

# Share of a segment's size by which it may differ from the nominal one in more than scale.
_SAME_SHAPE = 1e-3


def true_scales(nominal: Body, true: Body, segments: Iterable[str]) -> dict[str, float]:
    """True over nominal size of segments; without those that are not one another's likeness.

    Between bodies of `human`, whose proportions may differ, it is that of their lengths.
    """
    try:
        lengths, longer = segment_lengths(nominal), segment_lengths(true)
    except InputError:
        lengths, longer = {}, {}
    out: dict[str, float] = {}
    for name in segments:
        if name in lengths:
            out[name] = longer[name] / lengths[name]
        elif (scale := _likeness(nominal, true, name)) is not None:
            out[name] = scale
    return out


def _likeness(nominal: Body, true: Body, segment: str) -> float | None:
    """The factor between the shapes of a segment in two bodies; None where there is none."""
    if not all(segment in body.topology.body_names for body in (nominal, true)):
        return None
    for measure in (_ends, _shapes):  # shapes say less of the length: they are the last resort
        a, b = (measure(body, segment) for body in (nominal, true))
        if a.shape != b.shape:
            return None
        if a.any() and b.any():
            scale = float(np.vdot(a, b) / np.vdot(a, a))
            off = float(np.linalg.norm(b - scale * a))
            return scale if off < _SAME_SHAPE * float(np.linalg.norm(b)) else None
    return None


def _ends(body: Body, segment: str) -> Float[np.ndarray, "n 3"]:
    """Where the next segments begin, by their names, and the tip [m]."""
    topology = body.topology
    at = topology.body_names.index(segment)
    following = {n: i for i, n in enumerate(topology.body_names) if topology.body_parent[i] == at}
    ends = [np.asarray(body.body_pos)[i] for _, i in sorted(following.items())]
    tip = segment_tip(body.mujoco_model(), segment)
    return np.reshape([*ends, *([] if tip is None else [tip])], (-1, 3))


def _shapes(body: Body, segment: str) -> Float[np.ndarray, "n 3"]:
    """Centre of mass, places and sizes of the shapes [m]."""
    model, at = body.mujoco_model(), body.topology.body_names.index(segment)
    mine = model.geom_bodyid == at
    return np.vstack([model.body_ipos[at], model.geom_pos[mine], model.geom_size[mine]])

"""Segment lengths of the human body, as arguments and as something to differentiate by.

The length of a segment is the distance from its joint to the next joint along the chain: Pelvis
(middle of the hips) to L5, then up to Head; Shoulder to UpperArm to ForeArm to Hand; UpperLeg to
LowerLeg to Foot to Toe. Head, Hand and Toe reach to the vertex and the tips of the middle finger
and of the toes. A segment of another length is stretched along one axis of its frame, its long one
(X of Foot and Toe, Y of Shoulder, else Z): joints, capsules, sites and mass move along it, breadth
and the height of the ankle over the sole stay.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence

import jax.numpy as jnp
import mujoco
import numpy as np
from jax import Array
from jax.core import Tracer
from jaxtyping import Float

from mocap_jax.body import Body, Topology
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.motion.human.proportions import LONG_AXIS, NEXT, SIDED, SIDES, side_of
from mocap_jax.motion.human.stretched_mjcf import stretched_mjcf
from mocap_jax.motion.segment_names import XSENS_SEGMENTS
from mocap_jax.motion.skeleton import TIP_PREFIX

_MIDDLE = tuple(name for name in XSENS_SEGMENTS if side_of(name)[0] == "")
_RANGE = (0.4, 2.5)


def segment_lengths(body: Body) -> dict[str, float]:
    """Lengths [m] of the 23 segments of a body of `human()`, as its MJCF has them.

    Raises:
        InputError: not a body of `human()`.
    """
    return {name: float(np.linalg.norm(end)) for name, end in _ends(body).items()}


def with_segment_lengths(
    body: Body,
    lengths: Float[Array, "n"] | Mapping[str, float],
    names: Sequence[str] | str | None = None,
) -> Body:
    """The body with other segment lengths; differentiable by them (`jit`, `grad`, `vmap`).

    Joints, sites and the root's height in `qpos0` follow as if `human(lengths=...)` had been
    called, soles on z = 0; so does the MJCF (`xml`), with capsules, centres of mass and moments of
    inertia. Of traced lengths (within `jit`, `grad`, `vmap`) no text can be written: the body then
    has an empty `xml`, and what needs the MJCF (`mujoco_model`, `segment_lengths`, files, this
    function once more) refuses it.

    Args:
        body: of `human()`, with or without sites.
        lengths: [m], may be traced; or a mapping from segments to them, without `names`.
        names: segment of each length; names without side stand for both sides. By default all, in
            the order of `segment_lengths(body)`.

    Raises:
        InputError: not a body of `human()`, unknown or repeated names, not one length each, or
            a length that the segment cannot have.
    """
    ends = _ends(body)
    if isinstance(lengths, Mapping):
        names, values = tuple(lengths), tuple(lengths.values())
        plain = not any(isinstance(x, Tracer) for x in values)
        lengths = np.array(values, float) if plain else jnp.stack([jnp.asarray(x) for x in values])
    traced = isinstance(lengths, Tracer)
    names = (names,) if isinstance(names, str) else tuple(ends) if names is None else tuple(names)
    if jnp.shape(lengths) != (len(names),):
        raise InputError(
            f"lengths must have one value for each of the {len(names)} names, "
            f"got shape {jnp.shape(lengths)}"
        )
    if not traced:  # plain numbers stay so, within a transformation of something else, too
        lengths = np.asarray(lengths, float)
    by_segment = {
        segment: lengths[i] for i, name in enumerate(names) for segment in both_sides(name)
    }
    if len(by_segment) < sum(len(both_sides(name)) for name in names):
        raise InputError(f"a segment has more than one length in {', '.join(names)}")
    topology = body.topology
    factors: list[Array | np.ndarray] = [np.ones(3)] * topology.nbody
    for segment, length in by_segment.items():
        part = side_of(segment)[1]
        if not traced:
            _check_length(segment, ends[segment], float(length))
        factors[topology.body_index(segment)] = stretch(part, ends[segment], length)
    factor = (jnp if traced else np).stack(factors)
    body_pos = body.body_pos * factor[np.array(topology.body_parent)]
    lift = _hip_height(topology, body_pos) - _hip_height(topology, body.body_pos)
    root = topology.body_index("Pelvis")
    site_pos = body.site_pos * factor[np.array(topology.site_body, int)]
    changed = body.replace(
        body_pos=body_pos.at[root, 2].add(lift),
        qpos0=body.qpos0.at[2].add(lift),
        site_pos=site_pos,
    )
    xml = "" if traced else _mjcf(body, factor, by_segment)
    return dataclasses.replace(changed, xml=xml)


def _mjcf(body: Body, factor: Float[np.ndarray, "nbody 3"], segments: Iterable[str]) -> str:
    """MJCF of the body with segments stretched, in plain numbers."""
    topology = body.topology
    # By the MJCF's own numbers: arrays of the body may be traced.
    place = body.mujoco_model().body_pos
    moved = place * factor[np.array(topology.body_parent)]
    lift = float(_hip_height(topology, moved) - _hip_height(topology, place))
    return stretched_mjcf(body.xml, {s: factor[topology.body_index(s)] for s in segments}, lift)


def _check_length(segment: str, end: Float[np.ndarray, "3"], length: float) -> None:
    across = float(np.linalg.norm(np.delete(end, LONG_AXIS[side_of(segment)[1]])))
    if not across < length < np.inf:
        raise InputError(
            f"length of {segment} must be above {across:.3g} m (its breadth stays), got {length}"
        )


def stretch(part: str, end: Float[np.ndarray, "3"], length: Array | float) -> Array | np.ndarray:
    """Factors (3) along X, Y and Z that give a segment its length; only one is not 1.

    Of a plain length plain numbers, also within a transformation of something else.
    """
    xp = jnp if isinstance(length, Tracer) else np
    axis = LONG_AXIS[part]
    across = float(np.delete(end, axis) @ np.delete(end, axis))
    factor = xp.sqrt(length**2 - across) / abs(float(end[axis]))
    return xp.where(np.arange(3) == axis, factor, 1.0)


def _hip_height(topology: Topology, body_pos: Array | np.ndarray) -> Array | np.ndarray:
    """Height of the hips over the ankle of the longer leg, in the zero pose."""
    xp = np if isinstance(body_pos, np.ndarray) else jnp
    index = topology.body_index
    legs = [sum(body_pos[index(side + p), 2] for p in ("LowerLeg", "Foot")) for side in SIDES]
    return -xp.minimum(*legs)


def both_sides(name: str) -> tuple[str, ...]:
    """Segments that a name stands for; raises `InputError` with the valid names."""
    if name in SIDED:
        return tuple(side + name for side in SIDES)
    if name not in XSENS_SEGMENTS:
        error = unknown_name("segment", name, (*_MIDDLE, *SIDED))
        raise InputError(f"{error} (these with Right or Left before them for one side)")
    return (name,)


def checked_lengths(
    lengths: Mapping[str, float], ends: Mapping[str, Float[np.ndarray, "3"]]
) -> dict[str, float]:
    """Lengths by full segment name; a name with a side goes before one without.

    Raises:
        InputError: unknown name, or a length outside 0.4 to 2.5 times that of the proportions.
    """
    result: dict[str, float] = {}
    for name, length in sorted(lengths.items(), key=lambda item: item[0] not in SIDED):
        for segment in both_sides(name):
            usual = float(np.linalg.norm(ends[segment]))
            low, high = (factor * usual for factor in _RANGE)
            if not low <= length <= high:
                raise InputError(
                    f"lengths['{name}'] must be {low:.3g} to {high:.3g} m at this height, "
                    f"got {length}"
                )
            result[segment] = float(length)
    return result


def segment_tip(model: mujoco.MjModel, segment: str) -> Float[np.ndarray, "3"] | None:
    """Tip of a segment that no other follows, in its frame [m]; None where the MJCF has none."""
    i = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, TIP_PREFIX + segment)
    if i < 0:
        return None
    start = model.numeric_adr[i]
    return np.array(model.numeric_data[start : start + 3])


def _ends(body: Body) -> dict[str, Float[np.ndarray, "3"]]:
    """Far end of every segment in its frame [m], in the MJCF."""
    model = body.mujoco_model()
    names = body.topology.body_names
    if not set(XSENS_SEGMENTS) <= set(names) or segment_tip(model, "Head") is None:
        raise InputError("segment lengths are those of bodies made by human(); this is another one")
    ends = {}
    for segment in XSENS_SEGMENTS:
        side, part = side_of(segment)
        tip = segment_tip(model, segment)
        ends[segment] = model.body(side + NEXT[part]).pos.copy() if tip is None else tip
    return ends

"""The truth of a simulated recording, told for sensors that were mounted and headed anew."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body, load_body
from mocap_jax.body.site_displacement import site_displacement
from mocap_jax.initialise.true_scale import true_scales
from mocap_jax.recording import Truth

_TURN, _SHIFT = "mounting_rotation/", "mounting_position/"
_SCALE = "segment_scale/"

Told = dict[str, np.ndarray]


def with_true_mounting(
    truth: Truth | None, body: Body, headings: Mapping[str, float] | None = None
) -> Truth | None:
    """The truth with its parameters told from another nominal body and other headings.

    What cannot be told from the new body (of a site on another segment, or of another frame; the
    scale of a segment of another shape) is left out.

    Args:
        truth: of a recording whose sensors were mounted otherwise; None stays None.
        body: the new nominal one.
        headings: how far measured orientations were turned about the vertical, by sensor [rad].
    """
    if truth is None:
        return None
    bodily = [k for k in truth.parameters if k.startswith((_TURN, _SHIFT, _SCALE))]
    told = {k: v for k, v in truth.parameters.items() if k not in bodily}
    if bodily:
        true = load_body(truth.body_xml)
        told |= _scales(body, true, truth.parameters)
        mounted = [k for k in bodily if not k.startswith(_SCALE)]
        now = _mountings({k.split("/", 1)[1] for k in mounted}, body, true, told)
        told |= {k: now[k] for k in mounted if k in now}
    for sensor, turn in (headings or {}).items():
        told |= _turned(sensor, turn, told)
    return dataclasses.replace(truth, parameters=told)


def _scales(body: Body, true: Body, told: Mapping[str, object]) -> dict[str, object]:
    """Sizes of segments, true over nominal; as told before where that still holds."""
    before = {k.removeprefix(_SCALE): v for k, v in told.items() if k.startswith(_SCALE)}
    now = true_scales(body, true, before)
    same = {n for n, v in now.items() if np.isclose(float(np.asarray(before[n])), v, atol=1e-9)}
    return {_SCALE + n: before[n] if n in same else np.array(v) for n, v in now.items()}


def _mountings(sites: set[str], body: Body, true: Body, told: Mapping[str, object]) -> Told:
    """Turn in the site's frame and shift in the segment's, as the simulator tells them."""
    out: Told = {}
    for site in sites:
        found = site_displacement(body, true, site)
        if found is None:
            continue
        shift, out[_TURN + site] = found
        i = body.topology.site_index(site)
        segment = body.topology.body_names[body.topology.site_body[i]]
        # From the place that the longer or shorter segment would have it at.
        scale = np.asarray(told.get(_SCALE + segment, 1.0))
        place = np.asarray(body.site_pos)[i]
        R = Rotation.from_quat(np.asarray(body.site_quat)[i], scalar_first=True)
        out[_SHIFT + site] = R.apply(shift) + (1.0 - scale) * place
    return out


def _turned(sensor: str, turn: float, told: Mapping[str, object]) -> Told:
    """Heading and slow errors of a sensor whose measured orientations were turned."""
    out: Told = {}
    if (heading := told.get(f"heading/{sensor}")) is not None:
        out[f"heading/{sensor}"] = np.angle(np.exp(1j * (np.asarray(heading) + turn)))
    if (error := told.get(f"orientation_error/{sensor}")) is not None:
        now = Rotation.from_euler("z", turn) * Rotation.from_rotvec(np.array(error))
        out[f"orientation_error/{sensor}"] = now.as_rotvec()
    return out

"""World kinematics of the frames of one chunk, as the residuals need them."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax import so3
from mocap_jax.body import Body, frames, sites_on_frames
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.layout import Layout


class Window(NamedTuple):
    """Kinematics of n successive frames."""

    screws: Float[Array, "n 6 nv"]
    """Twist (linear, angular) per unit velocity, about `origin`, world axes."""
    origin: Float[Array, "n 3"]
    """Position of the root body: screws and wrenches refer to it, to keep digits."""
    position: Float[Array, "n s 3"]
    """World positions of the sensors, offsets included."""
    rotation: Float[Array, "n s 3 3"]
    """R_world_sensor, mounting included."""
    site_rotation: Float[Array, "n s 3 3"]
    """R_world_site."""
    range_position: Float[Array, "n r 3"]
    """Of receivers, offsets included."""
    range_rotation: Float[Array, "n r 3 3"]
    source_position: Float[Array, "n r 3"]
    """Of sources: a board that emits does so from its nominal place."""
    spans: Float[Array, "n l 3"]
    """World offsets, at their nominal length, of the bodies in `Layout.lengths` [m]."""
    child_rotation: Float[Array, "n j 3 3"]
    """R_world_segment of the children of `Layout.pose_joints`."""
    parent_rotation: Float[Array, "n j 3 3"]
    """The same of their parents."""
    foot_rotation: Float[Array, "n p 3 3"]
    """R_world_segment of `Layout.contact_bodies`."""
    foot_position: Float[Array, "n p 3"]
    range_scale: Float[Array, ""]
    """Speed of sound over the declared one."""
    range_offset: Float[Array, "r"]
    """Constant error of the ranges of each source [m]."""


def kinematics(layout: Layout, body: Body, q: Float[Array, "n nq"], constants: Constants) -> Window:
    """Evaluate the body in all frames of a chunk."""
    stretched = _stretched(layout, body, constants.geometry.length)
    f = jax.vmap(lambda x: frames(stretched, x))(q)
    rotation, position = jax.vmap(lambda x: sites_on_frames(stretched, x))(f)
    origin = f.position[:, layout.root_body]
    linear = f.linear + so3.cross(f.angular, origin[:, None, :])
    screws = jnp.concatenate([linear, f.angular], axis=-1)
    sensors, ranged = np.array(layout.sites, int), np.array(layout.range_sites, int)
    receiving, emitting = _offsets_of_range_sites(layout, constants)
    longer = np.array(layout.lengths, int)
    parents = np.array(layout.topology.body_parent)[longer]
    child, parent = np.array(layout.pose_joints, int).reshape(-1, 2).T
    feet = np.array(layout.contact_bodies, int)
    return Window(
        jnp.swapaxes(screws, 1, 2),
        origin,
        position[:, sensors] + so3.matvec3(rotation[:, sensors], constants.offset),
        so3.matmul3(rotation[:, sensors], constants.mounting),
        rotation[:, sensors],
        position[:, ranged] + so3.matvec3(rotation[:, ranged], receiving),
        rotation[:, ranged],
        position[:, ranged] + so3.matvec3(rotation[:, ranged], emitting),
        so3.matvec3(f.rotation[:, parents], body.body_pos[longer]),
        f.rotation[:, child],
        f.rotation[:, parent],
        f.rotation[:, feet],
        f.position[:, feet],
        1.0 + jnp.asarray(constants.geometry.sound).sum(),
        _range_offsets(layout, constants),
    )


def _stretched(layout: Layout, body: Body, length: Array) -> Body:
    """The body with the unknown segment lengths."""
    if not layout.lengths:
        return body
    bodies = np.array(layout.lengths, int)
    offsets = body.body_pos[bodies] * (1.0 + length)[:, None]
    return body.replace(body_pos=body.body_pos.at[bodies].set(offsets))


def sensor_of_range_site(layout: Layout) -> np.ndarray:
    """Sensor that sits at each source or receiver (r,); -1 where none does."""
    return np.array(
        [layout.sites.index(s) if s in layout.sites else -1 for s in layout.range_sites], int
    )


def _offsets_of_range_sites(layout: Layout, constants: Constants) -> tuple[Array, Array]:
    """Offsets of every range site (r, 3) as a receiver (its board's) and as a source."""
    # A last row of zeros is for those whose place is certain.
    padded = lambda x: jnp.concatenate([jnp.asarray(x), jnp.zeros((1, 3))])  # noqa: E731
    receiving = padded(constants.offset)[sensor_of_range_site(layout)]
    return receiving, padded(constants.geometry.source)[source_of_range_site(layout)]


def _range_offsets(layout: Layout, constants: Constants) -> Array:
    padded = jnp.concatenate([jnp.asarray(constants.geometry.range_offset), jnp.zeros(1)])
    return padded[place_among(layout.emitters, layout)]


def source_of_range_site(layout: Layout) -> np.ndarray:
    """Unknown source (position in `Layout.sources`) at each range site (r,); -1 where none is."""
    return place_among(layout.sources, layout)


def place_among(chosen: tuple[int, ...], layout: Layout) -> np.ndarray:
    """Place of each range site (r,) among chosen ones; -1 where it is not one of them."""
    place = {site: i for i, site in enumerate(chosen)}
    return np.array([place.get(r, -1) for r in range(len(layout.range_sites))], int)


def lengths_beneath(layout: Layout, sites: tuple[int, ...]) -> np.ndarray:
    """Mask (n, l): a longer segment moves the site."""
    topology = layout.topology
    return lengths_above(layout, tuple(topology.site_body[s] for s in sites))


def lengths_above(layout: Layout, bodies: tuple[int, ...]) -> np.ndarray:
    """Mask (n, l): a longer segment moves the body."""
    topology = layout.topology
    mask = np.zeros((len(bodies), len(layout.lengths)), bool)
    for i, b in enumerate(bodies):
        while b:
            if b in layout.lengths:
                mask[i, layout.lengths.index(b)] = True
            b = topology.body_parent[b]
    return mask


def sensor_dofs(layout: Layout) -> np.ndarray:
    """Mask (s, nv): degrees of freedom that move each sensor."""
    bodies = np.array(layout.topology.site_body)[np.array(layout.sites, int)]
    return layout.topology.body_dofs[bodies]


def range_dofs(layout: Layout) -> np.ndarray:
    """Mask (r, nv): degrees of freedom that move each source or receiver."""
    bodies = np.array(layout.topology.site_body)[np.array(layout.range_sites, int)]
    return layout.topology.body_dofs[bodies]

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
from mocap_jax.estimate.sequence.layout import Constants, Layout


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
    range_rotation: Float[Array, "n r 3 3"]


def kinematics(layout: Layout, body: Body, q: Float[Array, "n nq"], constants: Constants) -> Window:
    """Evaluate the body in all frames of a chunk."""
    f = jax.vmap(lambda x: frames(body, x))(q)
    rotation, position = jax.vmap(lambda x: sites_on_frames(body, x))(f)
    origin = f.position[:, layout.root_body]
    linear = f.linear + so3.cross(f.angular, origin[:, None, :])
    screws = jnp.concatenate([linear, f.angular], axis=-1)
    sensors, ranged = np.array(layout.sites, int), np.array(layout.range_sites, int)
    carried = _offsets_of_range_sites(layout, constants.offset)
    return Window(
        jnp.swapaxes(screws, 1, 2),
        origin,
        position[:, sensors] + so3.matvec3(rotation[:, sensors], constants.offset),
        so3.matmul3(rotation[:, sensors], constants.mounting),
        rotation[:, sensors],
        position[:, ranged] + so3.matvec3(rotation[:, ranged], carried),
        rotation[:, ranged],
    )


def sensor_of_range_site(layout: Layout) -> np.ndarray:
    """Sensor that sits at each source or receiver (r,); -1 where none does."""
    return np.array(
        [layout.sites.index(s) if s in layout.sites else -1 for s in layout.range_sites], int
    )


def _offsets_of_range_sites(layout: Layout, offset: Array) -> Array:
    sensor = sensor_of_range_site(layout)
    return jnp.where(sensor[:, None] >= 0, offset[np.maximum(sensor, 0)], 0.0)


def sensor_dofs(layout: Layout) -> np.ndarray:
    """Mask (s, nv): degrees of freedom that move each sensor."""
    bodies = np.array(layout.topology.site_body)[np.array(layout.sites, int)]
    return layout.topology.body_dofs[bodies]


def range_dofs(layout: Layout) -> np.ndarray:
    """Mask (r, nv): degrees of freedom that move each source or receiver."""
    bodies = np.array(layout.topology.site_body)[np.array(layout.range_sites, int)]
    return layout.topology.body_dofs[bodies]

"""Articulated bodies: structure, kinematics and calculus on poses."""

from mocap_jax.body.floating_sites import floating_dofs, site_segments, with_floating_sites
from mocap_jax.body.kinematics import (
    Frames,
    SiteFrames,
    SiteMotion,
    frames,
    site_frames,
    site_jacobians,
    site_motion,
    sites_on_frames,
)
from mocap_jax.body.model import Body, body_from_model, load_body
from mocap_jax.body.tangent import difference, normalise, retract, transport
from mocap_jax.body.topology import Topology

__all__ = [
    "Body", "Frames", "SiteFrames", "SiteMotion", "Topology", "body_from_model", "difference",
    "floating_dofs", "frames", "load_body", "normalise", "retract", "site_frames",
    "site_jacobians", "site_motion", "site_segments", "sites_on_frames", "transport",
    "with_floating_sites",
]  # fmt: skip

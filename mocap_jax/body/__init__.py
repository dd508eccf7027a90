"""Articulated bodies: structure, kinematics and calculus on poses."""

from mocap_jax.body.coupling import Coupling, coupled_joints, couplings, follow
from mocap_jax.body.floating_sites import (
    floating_dofs,
    joint_dofs,
    site_segments,
    with_floating_sites,
)
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
from mocap_jax.body.piecewise import Piecewise
from mocap_jax.body.reach import reach
from mocap_jax.body.tangent import difference, normalise, retract, transport
from mocap_jax.body.topology import Topology

__all__ = [
    "Body", "Coupling", "Frames", "Piecewise", "SiteFrames", "SiteMotion", "Topology",
    "body_from_model", "coupled_joints", "couplings", "difference", "floating_dofs", "follow",
    "frames", "joint_dofs", "load_body", "normalise", "reach", "retract", "site_frames",
    "site_jacobians", "site_motion", "site_segments", "sites_on_frames", "transport",
    "with_floating_sites",
]  # fmt: skip

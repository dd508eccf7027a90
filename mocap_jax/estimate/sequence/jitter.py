"""How much damping of jitter the solver of a sequence needs, and where.

Jitter that boards do not see to first order (joints of the spine against each other) they see to
second: undamped, it would grow until its square throws steps back.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from mocap_jax.estimate.sequence.layout import Layout
from mocap_jax.estimate.sequence.user_residuals import COUPLINGS, KNEES

# Least damping, relative to what the boards' readings hold jitter with: from a third of it to three
# times as much, solves take the same number of steps.
_SHARE = 3e-5
# Distance of boards from the joints that turn them [m].
_LEVER = 0.3
# For problems without boards [1/rad^2].
_LEAST = 1e3


def bending(layout: Layout) -> Bool[np.ndarray, "nv"]:
    """Degrees of freedom that move the root, a sensor, an end of a distance or a standing foot.

    Others are held by linear terms alone; what a user's own residuals hold is not known.
    """
    topology = layout.topology
    if any(r.name not in (KNEES, COUPLINGS) for r in layout.user):
        return np.ones(topology.nv, bool)
    sites = np.array([*layout.sites, *layout.range_sites], int)
    moved = np.asarray(topology.site_body, int)[sites]
    return np.asarray(
        topology.body_dofs[[layout.root_body, *layout.contact_bodies, *moved]].any(axis=0)
    )


def least_damping(
    rate_information: Float[np.ndarray, "t s"],
    force_information: Float[np.ndarray, "t s"],
    step: float,
) -> float:
    """A share of how firmly boards hold second differences of joint angles [1/rad^2].

    Args:
        rate_information: inverse variances of rates [s^2/rad^2], 0 where absent.
        force_information: the same of accelerations [s^4/m^2].
        step: time between frames [s].
    """
    rate, force = _typical(rate_information) / step**2, _typical(force_information) / step**4
    return max(_SHARE * (rate + _LEVER**2 * force), _LEAST)


def _typical(information: Float[np.ndarray, "t s"]) -> float:
    """Of half of all frames or more: readings of a rest hold hold nothing while people move."""
    return float(np.median(np.median(information, axis=0))) if information.size else 0.0

"""What the outcome of a minimisation is called in a solution."""

from __future__ import annotations

from mocap_jax.least_squares import Outcome
from mocap_jax.solution import Status

STATUS_OF = {
    Outcome.CONVERGED: Status.CONVERGED,
    Outcome.MAX_ITERATIONS: Status.MAX_ITERATIONS,
    Outcome.STALLED: Status.STALLED,
    Outcome.SINGULAR: Status.SINGULAR,
    Outcome.DIVERGED: Status.DIVERGED,
}

"""The whole-sequence problem of the last frames of a recording, ready to iterate."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import jax
import numpy as np

from mocap_jax.body import load_body
from mocap_jax.estimate.constant_names import constants_from
from mocap_jax.estimate.initial_guess import on_grid
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.estimate.sequence.terms import build
from mocap_jax.estimate.whole_sequence_options import ConstantsOptions, OptimiseOptions
from mocap_jax.estimate.whole_sequence_run import Run
from mocap_jax.least_squares import Outcome, SolverOptions, minimise
from mocap_jax.measurement import gather
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution, Status

_NO_BORDER = ConstantsOptions(
    **{f.name: 0.0 for f in dataclasses.fields(ConstantsOptions) if f.name.endswith("_sigma")}
)


@dataclass(frozen=True)
class Prepared:
    """A problem, a state to iterate from, and the size of both."""

    problem: SequenceProblem
    state: State
    context: dict[str, int]

    def iterate(self) -> None:
        """One iteration as `optimise` does it, see `iterate`."""
        iterate(self.problem, self.state)


def iterate(problem: SequenceProblem, state: State) -> None:
    """Assemble, factor, solve, move, evaluate the cost.

    Raises:
        RuntimeError: the iteration did not go through, so its time means nothing.
    """
    done: list[float] = []
    result = minimise(
        problem, state, SolverOptions(max_iterations=1), lambda _, cost: done.append(cost)
    )
    # Not reported: the factorisation failed, and neither solve nor cost was timed.
    if not done or result.outcome not in (Outcome.MAX_ITERATIONS, Outcome.CONVERGED):
        raise RuntimeError(f"the iteration ended {result.outcome.value}: {result.message}")


def prepare(recording: Recording, frames: int, *, border: bool) -> Prepared:
    """The problem of the last `frames` frames (motion, not the rest hold), from the true poses.

    Args:
        recording: with truth and a measured root.
        frames: how many.
        border: solve for the sensors' constants too.
    """
    options = OptimiseOptions() if border else OptimiseOptions(constants=_NO_BORDER)
    body = load_body(recording.body_xml, free_root=True)
    whole = gather(recording, body)
    data = jax.tree.map(lambda x: x[-frames:] if np.ndim(x) else x, whole)
    built = build(data, body, recording.setup, options, root_given=True)
    run = Run(recording, body, data, built, options)
    if built.layout.use_border != border:
        raise RuntimeError(f"the problem should{'' if border else ' not'} have a border")
    truth = true_poses(recording)
    constants = constants_from(truth, data.sensors, built.layout)
    state = State(on_grid(truth, body, np.asarray(data.time)), constants)
    run._set_levels(state, 0, last=True)
    present = int((np.asarray(data.range_weight) > 0).sum())
    context = {
        "frames": len(data.time), "dof": body.nv, "boards": len(data.sites), "ranges": present,
        "constants": built.layout.constants,
    }  # fmt: skip
    return Prepared(run.problem, state, context)


def true_poses(recording: Recording) -> Solution:
    """The truth of a simulated recording in the shape of an estimate."""
    return Solution(
        trajectory=dataclasses.replace(recording.truth.trajectory, v=None),
        body=load_body(recording.body_xml, free_root=True),
        status=Status.CONVERGED,
        method="truth",
        setup=recording.setup,
    )

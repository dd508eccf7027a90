"""Twenty iterations of the Sparse Inertial Poser's size, and where their time goes.

Once with the paper's unknowns (72 degrees of freedom a frame) and weights, and once as
`sparse_options` has it, with 18 displacements of boards a frame and 72 constants besides.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from functools import cache
from statistics import median

import jax
import numpy as np

import mocap_jax as mj
from benchmarks.metric import Metric
from mocap_jax.estimate.constant_names import constants_from
from mocap_jax.estimate.initial_guess import on_grid
from mocap_jax.estimate.rest_tilt import gather_with_rest
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.estimate.sequence.terms import build
from mocap_jax.estimate.skin import displaced, on_skin
from mocap_jax.estimate.whole_sequence_run import Run
from mocap_jax.least_squares import SolverOptions, minimise
from mocap_jax.simulation import named_suit
from mocap_jax.simulation.mounting import with_shapes

FRAMES, ITERATIONS = 1000, 20
# Von Marcard 2017, section 5.2: 7.5 minutes for 1000 frames and 20 iterations.
PAPER_S = 450.0
_RATE, _REPEATS = 60.0, 5


def sparse_poser() -> Metric:
    """Seconds of 20 iterations on 1000 frames, six boards, every joint a ball; the paper's sum."""
    options = mj.table1_options(_RATE)
    return _measured("sparse_poser_20_iterations_s", options)


def sparse_poser_default() -> Metric:
    """The same with all that our options for few boards add."""
    options = dataclasses.replace(mj.sparse_options(), root="free", covariance=False)
    return _measured("sparse_poser_default_20_iterations_s", options)


def _measured(name: str, options: mj.OptimiseOptions) -> Metric:
    problem, state, size = _prepare(options)
    minimise(problem, state, SolverOptions(max_iterations=1))  # compile
    done: list[float] = []
    busy = time.process_time()
    seconds = _seconds(
        lambda: minimise(
            problem, state, SolverOptions(max_iterations=ITERATIONS, tolerance=0.0),
            lambda _, cost: done.append(cost),
        )
    )  # fmt: skip
    busy = time.process_time() - busy
    parts = {"assembly_s": lambda: problem.linearise(state), "cost_s": lambda: problem.cost(state)}
    phases = {name: median(_seconds(job) for _ in range(_REPEATS)) for name, job in parts.items()}
    return Metric(
        name, seconds * ITERATIONS / len(done), "s", "lower", 9.0,
        {"frames": FRAMES, "boards": len(problem.layout.sites), "iterations": len(done)}
        | size | phases | {"processor_s": round(busy, 2), "paper_s": PAPER_S},
    )  # fmt: skip


def _prepare(options: mj.OptimiseOptions) -> tuple[SequenceProblem, State, dict[str, int]]:
    """The problem of the last frames of a walk, at the pose of the orientation pass."""
    recording = _walk()
    own = mj.ball_jointed(mj.load_body(recording.body_xml))
    body = on_skin(own, recording) if options.prior.skin_sigma else own
    whole = gather_with_rest(recording, body, options, root=False)
    data = jax.tree.map(lambda x: x[-FRAMES:] if np.ndim(x) else x, whole)
    built = build(data, body, recording.setup, options, root_given=False)
    run = Run(recording, body, data, built, options)
    start = mj.orientation_pass(
        recording, own,
        options=mj.OrientationPassOptions(
            pose_prior=options.pose_prior, warm_start=True, root="free"
        ),
    )  # fmt: skip
    constants = constants_from(start, data.sensors, built.layout, built.walk)
    poses = displaced(on_grid(start, own, np.asarray(data.time)), body)
    state = State(poses, constants)
    run._set_levels(state, 0, last=True)
    size = {"dof": own.nv, "displacements": body.nv - own.nv, "constants": built.layout.constants}
    return run.problem, state, size


@cache
def _walk() -> mj.Recording:
    """A walk there and back, twice as long as the built-in one, with six boards."""
    motion = mj.builtin_motion("walking")
    suit = named_suit("sip6_tnt15", with_shapes(motion.body))
    path = motion.trajectory
    twice = np.concatenate([path.q, path.q[-2::-1]])
    longer = mj.Trajectory((path.time[1] - path.time[0]) * np.arange(len(twice)), twice)
    recording = mj.simulate(
        dataclasses.replace(motion, trajectory=longer), profile="field", suit=suit,
        options=mj.SimulationOptions(orientations=True, inertial_rate_hz=_RATE),
    )  # fmt: skip
    # Of the declared pose only the root's place is kept: its angles are of hinges.
    rest = recording.setup.rest
    rest = dataclasses.replace(rest, pose={k: v for k, v in rest.pose.items() if k == "root"})
    setup = dataclasses.replace(recording.setup, rest=rest)
    return dataclasses.replace(recording, root=None, setup=setup)


def _seconds(job: Callable[[], object]) -> float:
    begin = time.perf_counter()
    job()
    return time.perf_counter() - begin

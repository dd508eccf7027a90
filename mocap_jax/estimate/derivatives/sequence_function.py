"""`differentiable`: an estimate as a function that `jax.grad`, `jvp` and `vmap` see through."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body
from mocap_jax.errors import InputError, SolveError
from mocap_jax.estimate.derivatives.implicit import TOLERANCE, minimum
from mocap_jax.estimate.derivatives.objective import Bound, Point, moved
from mocap_jax.estimate.derivatives.parameters import (
    Figures,
    Fixed,
    Measurements,
    ModelErrors,
    Parameters,
    SensorWeights,
    constants_prior,
    smoothness_kinds,
    terms_of,
)
from mocap_jax.estimate.derivatives.search import search
from mocap_jax.estimate.sequence.constants import Constants
from mocap_jax.estimate.sequence.levels import (
    GEOMETRY_KINDS,
    KINDS,
    SENSOR_KINDS,
)
from mocap_jax.estimate.shared_joints import shared_joints
from mocap_jax.estimate.whole_sequence import solve_sequence
from mocap_jax.estimate.whole_sequence_options import ConstantsOptions, OptimiseOptions
from mocap_jax.estimate.whole_sequence_run import Run
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution

# The minimum is closer than this [RMS, posterior standard deviations].
_REACHED = 1e-5


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Estimate:
    """The minimum for some parameters."""

    q: Float[Array, "t nq"]
    """Poses."""
    constants: Constants
    """Biases, mountings, offsets and geometry."""
    to_go: Float[Array, ""]
    """RMS distance to the minimum [posterior standard deviations]: not small where the parameters
    are too far from those of the solution."""


class Differentiable:
    """The estimate of a recording as a function of `Parameters`.

    It is the minimum of the cost as the solver left it: robust gates of ranges, which readings
    exist, variances that follow the motion, and the model errors and priors that the recording
    showed are held (the latter two are parameters).
    """

    def __init__(self, solution: Solution, fixed: Fixed, run: Run) -> None:
        problem = run.problem
        self.solution = solution
        """The solution that derivatives are taken at."""
        self.parameters = fixed.base
        """Parameters of the solution."""
        self.sensors = run.data.sensors
        """Names of the sensors, in the order of the arrays."""
        self._layout, self._fixed = problem.layout, fixed
        self._weights = problem.weights
        self._sound = jnp.asarray(solution.setup.speed_of_sound)
        found = search(problem, self._bound(self.parameters), run.state)
        if not found.size < _REACHED:
            raise SolveError(
                f"the minimum was not reached in {found.steps} steps ({found.size:.1e} posterior "
                f"deviations to go, valid: {_REACHED:.0e}); derivatives are undefined"
            )
        self._preconditioner, self._point = found.preconditioner, found.point
        # Closer than rounding let the search come there is no coming.
        self._tolerance = max(TOLERANCE, 2 * found.size)

    def __call__(self, parameters: Parameters) -> Estimate:
        """Poses and constants for other parameters, near those of the solution.

        Steps from the solution are taken with its factored normal equations.
        """
        point, size = self._moved(parameters)
        # What follows the body's own coordinates are displacements of boards on the skin.
        return Estimate(point.q[:, : self.solution.body.nq], point.constants, size)

    def _moved(self, parameters: Parameters) -> tuple[Point, Array]:
        bound = self._bound(parameters)
        step, size = minimum(
            self._layout, self._preconditioner, bound, self._point, self._tolerance
        )
        return moved(self._layout, self._point, step), size

    def _bound(self, p: Parameters) -> Bound:
        p = jax.tree.map(jnp.asarray, p)
        layout = self._layout
        terms = terms_of(layout, self._fixed, p, self._sound, self._weights.step)
        prior, readings = constants_prior(layout, self._fixed, p)
        return Bound(p.body, terms, self._weights, prior, readings)


def differentiable(
    recording: Recording,
    body: Body | None = None,
    *,
    initial: Solution | None = None,
    options: OptimiseOptions = OptimiseOptions(),  # noqa: B008  (frozen)
) -> Differentiable:
    """Solve a recording as `optimise` does, and return the estimate as a differentiable function.

    Derivatives are implicit ones at the minimum, second-order terms included: a gradient costs
    a few products with the Hessian, however many parameters there are.

    Args:
        recording: measured streams and their set-up.
        body: nominal body; default the recording's own.
        initial: where to start; default as `options.initial` says.
        options: see `OptimiseOptions`; float64 only.

    Raises:
        InputError: as `optimise`, constants whose derivatives are not worked out, or
            `options.dtype` is single precision.
        SolveError: the solve failed, the data do not determine every unknown, or the minimum was
            not reached.

    Example:
        estimate = mj.differentiable(recording)
        error = lambda p: ((estimate(p).q - truth) ** 2).sum()
        slopes = jax.grad(error)(estimate.parameters)
        slopes.figures.gyroscope, slopes.measurements.range_distance, slopes.body.site_pos
    """
    _refuse_corrections(options.constants)
    if options.dtype != "float64":
        raise InputError(
            f"options: dtype '{options.dtype}' has too few digits to find the minimum that "
            "derivatives are taken at; valid: 'float64'"
        )
    solution, run = solve_sequence(recording, body, initial=initial, options=options)
    if not solution.status.ok:
        raise SolveError(solution.status.value)
    return Differentiable(solution, _fixed(recording, solution, run), run)


def _refuse_corrections(options: ConstantsOptions) -> None:
    """Scales, clock offsets, headings and walks are no parameters yet."""
    if options.corrections:
        raise InputError(
            f"options.constants: derivatives do not know {', '.join(options.corrections)}; "
            "valid: 0 (off)"
        )


def _fixed(recording: Recording, solution: Solution, run: Run) -> Fixed:
    """What stays, and the parameters of the solution."""
    problem, data, built, layout = run.problem, run.data, run.built, run.problem.layout
    known = {
        kind: np.isfinite(np.asarray(getattr(data, kind)))
        for kind in ("accelerometer", "gyroscope")
    }
    position, quat = np.asarray(data.root_position), np.asarray(data.root_orientation)
    root = np.isfinite(position).all(1) & np.isfinite(quat).all(1)
    rest = np.zeros(len(data.time), bool)
    rest[built.rest_frames] = True
    fixed = Fixed(
        base=_base(recording, solution, run),
        terms=problem.terms,
        declared={k: np.where(np.isfinite(v[0]), v[0], 1.0) for k, v in built.variances.items()},
        model={k: np.where(np.isfinite(v[0]), v[1], 0.0) for k, v in built.variances.items()},
        known=known,
        smoothness_kind=smoothness_kinds(run.body, shared_joints(run.body, layout.sites)),
        root_known=root,
        rest_frames=rest,
        prior_information=problem.prior_information,
        readings=problem.readings,
    )
    return jax.tree.map(jnp.asarray, fixed)


def _base(recording: Recording, solution: Solution, run: Run) -> Parameters:
    data, levels, terms = run.data, run.levels, run.problem.terms
    options, noise = run.options, recording.setup.noise
    identity = np.array([1.0, 0.0, 0.0, 0.0])
    filled = lambda x, value=0.0: np.where(np.isfinite(x), x, value)  # noqa: E731
    prior = options.prior
    sensors = np.ones(len(data.sensors))
    return Parameters(
        measurements=Measurements(
            accelerometer=filled(np.asarray(data.accelerometer)),
            gyroscope=filled(np.asarray(data.gyroscope)),
            orientation=filled(np.asarray(data.orientation), identity),
            range_distance=np.asarray(terms.range_distance),
            root_position=filled(np.asarray(data.root_position)),
            root_orientation=filled(np.asarray(data.root_orientation), identity),
        ),
        figures=Figures(
            **{k: getattr(noise, k) for k in (*KINDS, "root_position", "root_orientation")},
            smoothness_density=prior.smoothness_density,
            shared_smoothness_density=prior.shared_smoothness_density,
            translation_density=prior.translation_density,
            pose_sigma=prior.pose_sigma,
            limit_sigma=prior.limit_sigma,
            rest_sigma=levels.rest,
            **{f"{k}_sigma": getattr(levels, k) for k in (*SENSOR_KINDS, *GEOMETRY_KINDS)},
        ),
        weights=SensorWeights(sensors, sensors, sensors, np.ones(())),
        model_errors=ModelErrors(**{k: np.asarray(levels.share[k]) for k in KINDS}),
        body=run.problem.body,
    )

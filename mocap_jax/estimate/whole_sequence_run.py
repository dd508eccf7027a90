"""One whole-sequence solve: rounds of minimisation, noise levels re-estimated in between."""

from __future__ import annotations

import dataclasses

import numpy as np
from tqdm import tqdm

from mocap_jax.body import Body
from mocap_jax.errors import SolveError
from mocap_jax.estimate.central_velocity import central_velocity
from mocap_jax.estimate.constant_names import calibration
from mocap_jax.estimate.gauge_remarks import gauge_remarks
from mocap_jax.estimate.inputs import mounting_remarks
from mocap_jax.estimate.magnetometers import stray_remarks
from mocap_jax.estimate.observed_joints import observed_joints
from mocap_jax.estimate.outcome_status import STATUS_OF
from mocap_jax.estimate.rest_biases import read_in_the_hold, rest_biases
from mocap_jax.estimate.sequence.adapt import implausible, re_estimate
from mocap_jax.estimate.sequence.corner import constant_values
from mocap_jax.estimate.sequence.levels import (
    Levels,
    any_wrong,
    information,
    initial_levels,
    prior_from,
    prior_information,
    repeats,
)
from mocap_jax.estimate.sequence.problem import SequenceProblem, State
from mocap_jax.estimate.sequence.statistics import residual_statistics
from mocap_jax.estimate.sequence.terms import Built
from mocap_jax.estimate.stated_covariance import StatedCovariance
from mocap_jax.estimate.whole_sequence_options import OptimiseOptions
from mocap_jax.estimate.whole_sequence_record import (
    ROUNDED_DEVIATIONS,
    option_record,
    prior_deviations,
    undetermined_remark,
)
from mocap_jax.least_squares import Outcome, Result, minimise
from mocap_jax.measurement import FrameData
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution, Status, determination_remark
from mocap_jax.trajectory import Trajectory

# Frames beyond which a free root's drift is lost in the rounding of J'J (condition ~ frames^4).
_LONG = 300

# Contacts are found in the motion of a first solve, and again in that of the second.
_CONTACT_ROUNDS = 3


class Run:
    """One solve: rounds of minimisation with noise levels re-estimated in between."""

    def __init__(
        self, recording: Recording, body: Body, data: FrameData, built: Built,
        options: OptimiseOptions,
    ) -> None:  # fmt: skip
        self.body, self.data, self.built, self.options = body, data, built, options
        layout = built.layout
        self.levels = initial_levels(options, len(layout.sites))
        self.repeats, self.doubted = repeats(options, len(data.time)), False
        self.problem = SequenceProblem(
            layout, body, built.terms, built.weights,
            self._prior_information(last=False), np.dtype(options.dtype),
            refines=self._loses_digits,
            readings=rest_biases(recording, data, layout, options),
            mixing=read_in_the_hold(built),
        )  # fmt: skip
        self.cost: list[float] = []
        self.iterations = 0
        self.state: State
        """What `solve` found."""

    @property
    def _loses_digits(self) -> bool:
        """Whether the slow drift of a root that nothing ties is lost in J'J: a long sequence."""
        adrift = any(root.tie == "none" for root in self.built.roots)
        return adrift and not self.options.user_residuals and len(self.data.time) > _LONG

    def solve(
        self, state: State, recording: Recording, *, root_given: bool, progress: bool
    ) -> Solution:
        """The solution from a start; a failed solve is a value."""
        generator = np.random.default_rng(0)
        rounds = self.options.noise.rounds if self._adapts() else 1
        if self.built.contacts is not None:
            rounds = max(rounds, _CONTACT_ROUNDS)
        result = Result(state, Outcome.MAX_ITERATIONS, ())
        with tqdm(desc="optimise", unit="iteration", disable=not progress) as bar:
            number, last = 0, rounds == 1
            while True:
                changed = self._set_levels(result.state, number, last=last)
                result = self._minimise(result.state, bar, last=last)
                if last or result.outcome in (Outcome.SINGULAR, Outcome.DIVERGED):
                    break
                levels = self._re_estimated(result.state, changed, generator)
                number += 1
                last = number == rounds - 1 or (number > 1 and self._settled(levels))
                self.levels = levels
        self.state = result.state
        return self._solution(result, changed, recording, root_given=root_given)

    def _settled(self, levels: Levels) -> bool:
        """Whether another solve would not change the model errors, or none are left."""
        return levels.same_shares(self.levels) or not any_wrong(levels, self.built)

    def _re_estimated(
        self, state: State, changed: dict[str, np.ndarray], generator: np.random.Generator
    ) -> Levels:
        """Levels as a solution shows them; unchanged where its equations are singular."""
        if not self._adapts():
            return self.levels
        try:
            levels = re_estimate(
                self.problem, state, self.built, changed, self.levels, self.options, generator
            )
        except SolveError:
            return self.levels
        # A recording that was taken for clean once, and wrongly, keeps all its model errors.
        if self.built.layout.use_border and not self.doubted:
            self.doubted = implausible(self.problem, state, self.options.constants)
        return levels.with_full_share() if self.doubted else levels

    def _prior_information(self, *, last: bool) -> np.ndarray:
        return prior_information(self.levels, self.built, self.repeats, last=last)

    def _adapts(self) -> bool:
        return self.options.noise.adapt or self.options.constants.adapt

    def _set_levels(self, state: State, number: int, *, last: bool) -> dict[str, np.ndarray]:
        """Whiten for the next round: noise levels, priors, gate and graduation at this state."""
        changed = self._information(state, self.repeats)
        self.problem.replace_terms(**changed)
        self.problem.prior_information = self._prior_information(last=last)
        mu = self.options.noise.range_mu
        graduation = mu[-1] if last else mu[min(number, len(mu) - 1)]
        self.problem.replace_weights(range_mu=graduation)
        if self.built.contacts is not None:
            contact, ground = self.built.contacts.update(state.q, number, last=last)
            self.problem.replace_terms(contact=contact)
            self.problem.replace_weights(ground=ground)
        return changed

    def _information(self, state: State, repeats: float) -> dict[str, np.ndarray]:
        facing = self.built.layout.use_range and self.options.noise.range_facing
        gate = self.problem.gate(state) if facing else None
        return information(self.built, gate, self.levels, repeats)

    def _minimise(self, state: State, bar: tqdm, *, last: bool) -> Result:
        solver = self.options.solver
        if not last:
            # Rounds before the last only feed the noise estimate.
            solver = dataclasses.replace(
                solver, tolerance=max(solver.tolerance, 0.1),
                max_iterations=min(solver.max_iterations, 8),
            )  # fmt: skip

        def report(_: int, cost: float) -> None:
            self.iterations += 1
            bar.update()
            bar.set_postfix_str(f"cost {cost:.6g}")

        result = minimise(self.problem, state, solver, report)
        self.cost += list(result.cost)
        return result

    def _solution(
        self, result: Result, changed: dict[str, np.ndarray], recording: Recording, *,
        root_given: bool,
    ) -> Solution:  # fmt: skip
        state = result.state
        status, remarks = STATUS_OF[result.outcome], [result.message] if result.message else []
        covariance, pairs, constants = None, None, None
        if status.ok:
            try:
                covariance, pairs, constants = self._stated.of_all(state, self.options)
            except SolveError as error:
                status = Status.UNDETERMINED
                remarks.append(undetermined_remark(str(error), root_given, self._oriented))
                if (constants := self._stated.of_constants_alone(state)) is not None:
                    remarks.append(ROUNDED_DEVIATIONS)
        solution = Solution(
            trajectory=Trajectory(np.asarray(self.data.time), state.q, self._velocity(state)),
            body=self.body,
            status=status,
            method="optimise",
            setup=recording.setup,
            remarks=(
                *recording.salvage,
                *mounting_remarks(recording),
                *stray_remarks(recording, self.options.kinds),
                *remarks,
                *self._gauge,
            ),  # fmt: skip
            covariance=covariance,
            pair_covariance=pairs,
            observed=observed_joints(self.body, self.data),
            cost=tuple(self.cost),
            iterations=self.iterations,
            statistics=residual_statistics(
                self.problem.residuals(state), changed, self.built, self.data, self.body
            ),
            options=option_record(self.options, self.levels),
            **self._calibration(state, constants),  # type: ignore[arg-type]
        )
        told = determination_remark(solution) if self._reads_constants else ""
        return (
            dataclasses.replace(solution, remarks=(*solution.remarks, told)) if told else solution
        )

    @property
    def _gauge(self) -> tuple[str, ...]:
        return gauge_remarks(
            self.built.roots, kinds=self.options.kinds, oriented=self._oriented,
            contacts=self.built.contacts is not None,
        )  # fmt: skip

    @property
    def _reads_constants(self) -> bool:
        """Whether readings are used that constants of sensors have a part in."""
        headings = self.options.constants.heading_sigma > 0
        return bool(set(self.options.kinds) & {"A", "G", "D"}) or headings

    @property
    def _oriented(self) -> bool:
        """Whether measured orientations are used."""
        return "O" in self.options.kinds and bool(np.isfinite(self.data.orientation).any())

    @property
    def _stated(self) -> StatedCovariance:
        return StatedCovariance(
            self.problem, self.built, self.levels, self.repeats,
            lambda state: self._information(state, 1.0)["reference_information"],
        )  # fmt: skip

    def _calibration(self, state: State, covariance: np.ndarray | None) -> dict[str, object]:
        """Constants by name, with their deviations; NaN where the covariance is unknown."""
        layout = self.built.layout
        if not layout.use_border:
            return {}
        sensors, values = self.data.sensors, constant_values(state.constants)
        found, deviations = calibration(layout, sensors, values, covariance, self.built.walk)
        once = prior_from(self.levels, layout, np.ones(layout.constants))
        prior = prior_deviations(layout, sensors, once)
        return {
            "calibration": found,
            "calibration_std": deviations,
            "calibration_prior_std": prior,
            "calibration_covariance": covariance,
        }

    def _velocity(self, state: State) -> np.ndarray:
        """Central differences of the poses, in the tangent space."""
        return central_velocity(self.body, state.q, float(self.data.step))

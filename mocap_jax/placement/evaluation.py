"""What a placement is worth: expected errors of joint centres over all motions, with slopes.

An error criterion is a sum of x'H^-1 x over fixed right-hand sides, whose derivative by anything
that H depends on is - y' dH y with y = H^-1 x: one factorisation, one solve and products with the
boards' Jacobian rows. Traces use random signs (Hutchinson), the same for all placements, so that
criteria are smooth functions of a placement.

H is linear in the boards' weights w, and each criterion f is convex and homogeneous of degree -1 in
H, so 1/f is concave in w: at every evaluated w there is an affine bound of 1/f for all w (`Cut`).
For the trace it follows from 1/tr(A H^-1 A') = min tr(Y'HY) over Y with tr(AY) = 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from mocap_jax.placement.options import PlacementOptions
from mocap_jax.placement.posterior import Posterior, posterior_of
from mocap_jax.placement.rows import CONSTANTS, Boards, energies, energy_slopes
from mocap_jax.placement.scene import Scene

# Power of the smooth maximum over joints.
_SHARP = 8.0
# Steps of the power iteration for the worst direction.
_POWER_STEPS = 12


@dataclass(frozen=True)
class Cut:
    """1/f(w) <= constant + slope . w for all weights w of the candidates."""

    constant: float
    slope: Float[np.ndarray, "n"]

    def bound(self, weights: np.ndarray) -> np.ndarray:
        """Least possible f at weights (..., n)."""
        return 1 / np.maximum(self.constant + weights @ self.slope, 1e-300)


@dataclass(frozen=True)
class Evaluation:
    """Value of the criterion and its parts."""

    value: float
    """Of the criterion, over all motions."""
    variance: Float[np.ndarray, "motions j"]
    """Expected squared error of each joint centre relative to the root [m^2], or of each segment's
    orientation [rad^2] if `PlacementOptions.quantity` says so."""
    directions: tuple[tuple[np.ndarray, np.ndarray], ...]
    """Per motion, scaled y = H^-1 x: the value's change is minus the sum of their energies."""
    posteriors: tuple[Posterior, ...]

    @property
    def rms_cm(self) -> float:
        """Mean over motions and joints of the expected error's root mean square [cm]; of joint
        centres (quantity `position`)."""
        return float(100 * np.sqrt(self.variance).mean())

    @property
    def rms_deg(self) -> float:
        """The same of orientations [deg] (quantity `orientation`)."""
        return float(np.rad2deg(np.sqrt(self.variance)).mean())


class Criterion:
    """A criterion over the scenes of a study."""

    def __init__(self, scenes: tuple[Scene, ...], options: PlacementOptions) -> None:
        self.scenes, self.options = scenes, options
        self._right = self._right_hand_sides(options.quantity)

    def _right_hand_sides(self, quantity: str) -> tuple[np.ndarray, ...]:
        """The same random signs whatever is asked for."""
        seed = self.options.search.seed
        return tuple(
            right_hand_sides(
                replace(s, quantity=quantity), self.options, np.random.default_rng((seed, i))
            )
            for i, s in enumerate(self.scenes)
        )

    def variance_of(self, evaluation: Evaluation, quantity: str) -> Float[np.ndarray, "motions j"]:
        """Expected squared errors of any quantity under an evaluated placement [m^2, rad^2]."""
        if quantity == self.options.quantity:
            return evaluation.variance
        out = []
        for posterior, right in zip(
            evaluation.posteriors, self._right_hand_sides(quantity), strict=True
        ):
            x, _ = posterior.solve(right)
            quadratic = np.einsum("tvp,tvp->p", right, x)
            out.append(quadratic.reshape(-1, self.options.probes).mean(1))
        return np.array(out)

    def evaluate(self, boards: Boards) -> Evaluation:
        """Expected errors under a placement."""
        posteriors, variances, solved = [], [], []
        for scene, right in zip(self.scenes, self._right, strict=True):
            posterior = posterior_of(scene, boards, self.options.errors)
            x, z = posterior.solve(right)
            quadratic = np.einsum("tvp,tvp->p", right, x)
            variances.append(quadratic.reshape(len(scene.joints), -1).mean(1))
            posteriors.append(posterior)
            solved.append((x, z))
        variance = np.array(variances)
        value, directions = self._combine(variance, solved, posteriors)
        return Evaluation(value, variance, directions, tuple(posteriors))

    def risk(self, evaluation: Evaluation) -> Float[np.ndarray, "motions j"]:
        """Expected squared errors [m^2] in these very motions: see `estimator_risk`."""
        return np.array(
            [
                estimator_risk(*parts)
                for parts in zip(self.scenes, evaluation.posteriors, self._right, strict=True)
            ]
        )

    def _combine(
        self, variance: np.ndarray, solved: list, posteriors: list[Posterior]
    ) -> tuple[float, tuple]:
        """Value, and directions scaled such that the value's change is minus their energies."""
        kind = self.options.objective
        if kind in ("D", "E"):
            own = _volume if kind == "D" else _worst_direction
            each = [
                own(s, p, self._generator(i))
                for i, (s, p) in enumerate(zip(self.scenes, posteriors, strict=True))
            ]
            share = self._shares(np.array([value for value, _ in each]))
            total = float(share @ [value for value, _ in each])
            scaled = [
                tuple(np.sqrt(c) * part for part in directions)
                for c, (_, directions) in zip(share, each, strict=True)
            ]
            return total, tuple(scaled)
        of_motions, by_joint = _over_joints(variance, kind)
        share = self._shares(of_motions)
        probes = self.options.probes
        out = []
        for c, weights, (x, z) in zip(share, by_joint, solved, strict=True):
            root = np.sqrt(c * np.repeat(weights, probes) / probes)
            out.append((x * root, z * root))
        return float(share @ of_motions), tuple(out)

    def _shares(self, values: np.ndarray) -> np.ndarray:
        """Derivative of the value by those of the motions (all are homogeneous of degree 1)."""
        if self.options.over == "mean":
            return np.full(len(values), 1 / len(values))
        return np.eye(len(values))[values.argmax()]

    def _generator(self, index: int) -> np.random.Generator:
        return np.random.default_rng((self.options.search.seed, index, 1))

    def cut(self, boards: Boards, evaluation: Evaluation) -> Cut:
        """The bound that an evaluation gives for all weights of the same boards."""
        own = sum(
            np.asarray(energies(s.body.topology, s.kinematics, boards, self.options.errors, *d))
            for s, d in self._padded(evaluation)
        )
        f = evaluation.value
        # The boards' and the priors' energies add up to f itself.
        return Cut((f - float(own @ np.asarray(boards.weight))) / f**2, own / f**2)

    def slope(self, boards: Boards, evaluation: Evaluation) -> Float[np.ndarray, "n 3"]:
        """Derivative of the value by the boards' positions."""
        return -sum(
            np.asarray(
                energy_slopes(s.body.topology, s.kinematics, boards, self.options.errors, *d)
            )
            for s, d in self._padded(evaluation)
        )

    def _padded(
        self, evaluation: Evaluation
    ) -> Iterator[tuple[Scene, tuple[jax.Array, jax.Array]]]:
        """Directions of every scene, as the traced functions take them."""
        for scene, (x, z) in zip(self.scenes, evaluation.directions, strict=True):
            t = len(scene.kinematics.present)
            padded = np.pad(x, ((0, t - len(x)), (0, 0), (0, 0)))
            yield scene, (jnp.asarray(padded), jnp.asarray(z.reshape(-1, CONSTANTS, z.shape[-1])))


def estimator_risk(
    scene: Scene, posterior: Posterior, right: Float[np.ndarray, "t nv j*p"]
) -> Float[np.ndarray, "j"]:
    """Expected squared error [m^2] of each joint centre in this very motion (or [rad^2]).

    The posterior variance is a mean over motions that the prior allows. In one motion, noise alone
    goes through the estimator's gain, and the priors' pull away from it is a bias:
    tr(A H^-1 (H - P) H^-1 A') + |A H^-1 g|^2 with the priors' information P and gradient g.

    Args:
        scene: the motion.
        posterior: under a placement.
        right: right-hand sides, see `right_hand_sides`.
    """
    x, _ = posterior.solve(right)
    prior = _product(scene.prior.lower, x)
    noise = np.einsum("tvp,tvp->p", x, right - prior).reshape(len(scene.joints), -1).mean(1)
    bias, _ = posterior.solve(scene.prior.pull[..., None])
    moved = np.einsum("jtav,tv->jta", scene.target, bias[..., 0])
    return noise + (moved**2).sum((1, 2))


def _product(lower: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Block-banded symmetric matrix times x (t, nv, p)."""
    out = lower[:, 0] @ x
    for o in range(1, lower.shape[1]):
        block = lower[:-o, o]
        out[o:] += block @ x[:-o]
        out[:-o] += np.swapaxes(block, 1, 2) @ x[o:]
    return out


def right_hand_sides(
    scene: Scene, options: PlacementOptions, generator: np.random.Generator
) -> Float[np.ndarray, "t nv j*p"]:
    """A'z for random signs z over time and axes, per joint."""
    j, t, _, nv = scene.target.shape
    signs = generator.choice([-1.0, 1.0], size=(j, options.probes, t, 3))
    right = np.einsum("jpta,jtav->tvjp", signs, scene.target)
    return np.ascontiguousarray(right.reshape(t, nv, -1))


def _over_joints(variance: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Value of each motion and its derivatives by the joints' variances."""
    if kind == "A":
        return variance.mean(1), np.full_like(variance, 1 / variance.shape[1])
    # The power mean is convex and homogeneous, so bounds hold for it as well.
    value = (variance**_SHARP).sum(1) ** (1 / _SHARP)
    return value, (variance / value[:, None]) ** (_SHARP - 1)


def _volume(scene: Scene, posterior: Posterior, generator: np.random.Generator) -> tuple:
    """det(H)^(-1/n), the mean variance of a pose coordinate in the geometric sense."""
    t, nv, m = posterior.coupling.shape
    n = t * nv + m
    value = float(np.exp(-posterior.log_determinant / n))
    draws = posterior.root_solve(
        generator.choice([-1.0, 1.0], size=(t, nv, _DRAWS)),
        generator.choice([-1.0, 1.0], size=(m, _DRAWS)),
    )
    root = np.sqrt(value / n / _DRAWS)
    return value, tuple(root * d for d in draws)


# Random draws for the derivative of a log determinant.
_DRAWS = 16


def _worst_direction(scene: Scene, posterior: Posterior, generator: np.random.Generator) -> tuple:
    """Largest eigenvalue of A H^-1 A', joint centres of all frames together, and its direction."""
    # Frames share the mean: an eigenvalue is a sum over frames of a mean square.
    target = scene.target / np.sqrt(len(scene.joints))
    z = generator.normal(size=target.shape[:3])
    for _ in range(_POWER_STEPS):
        z /= np.linalg.norm(z)
        right = np.einsum("jta,jtav->tv", z, target)[..., None]
        x, constants = posterior.solve(right)
        value = float((right * x).sum())
        z = np.einsum("jtav,tv->jta", target, x[..., 0])
    return value, (x, constants)

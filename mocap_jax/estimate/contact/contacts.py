"""Contacts of one solve: found anew before each round, as arrays of the problem."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from mocap_jax.body import Body
from mocap_jax.estimate.contact.detect import standing_boards, standing_points
from mocap_jax.estimate.contact.feet import Feet, feet_of, positions
from mocap_jax.estimate.contact.options import ContactOptions
from mocap_jax.estimate.sequence.layout import Ground
from mocap_jax.measurement import FrameData

# How long a stance takes [s]: its height is one observation.
_STANCE = 0.5


class Contacts:
    """Detection and weights of the contacts of one recording."""

    def __init__(
        self, data: FrameData, body: Body, standing: Float[np.ndarray, "nq"],
        options: ContactOptions, rest: np.ndarray, *, root_given: bool,
    ) -> None:  # fmt: skip
        """Args:
        data: measurements on the frame grid.
        body: as it is solved for.
        standing: pose with the feet flat on the ground.
        options: see `ContactOptions`.
        rest: frames of the declared rest hold.
        root_given: the root is measured.

        Raises:
            InputError: a body without feet.
        """
        self.feet: Feet = feet_of(body, standing)
        self._body, self._options, self._rest = body, options, rest
        self._step, self._drifts = float(data.step), not root_given
        self._boards = standing_boards(data, body, self.feet, options)
        self.standing: Bool[np.ndarray, "t p"] = self._boards
        """Which points stand, as last detected."""

    @property
    def fields(self) -> dict[str, object]:
        """Fields of `Layout`: segments of the points, and the robust loss."""
        return {"contact_bodies": self.feet.bodies, "contact_loss": self._options.loss}

    @property
    def none(self) -> tuple[np.ndarray, ...]:
        """Information where nothing is known of contacts yet."""
        return (np.zeros(self.standing.shape),) * 3

    def ground(self, height: float, mu: float) -> Ground:
        """Numbers of the traced part."""
        o = self._options
        numbers = (height, o.scale, min(1.0, self._step / _STANCE), mu)
        return Ground(self.feet.points, *(np.asarray(x) for x in numbers))

    def update(
        self, q: Float[np.ndarray, "t nq"], number: int, *, last: bool
    ) -> tuple[tuple[np.ndarray, ...], Ground]:
        """Information (see `Terms.contact`) and ground for a round, from the poses so far.

        Before the first round, poses are a guess whose root need not move: only boards tell then.
        """
        position = positions(self._body, self.feet, q)
        if number > 0:
            self.standing = self._boards | standing_points(
                position, self._step, self._options, drifts=self._drifts
            )
        mu = self._options.mu
        graduation = mu[-1] if last else mu[min(number, len(mu) - 1)]
        height = self._height(position[..., 2])
        return self._information(), self.ground(height, graduation)

    def _height(self, z: Float[np.ndarray, "t p"]) -> float:
        """Of the ground: as given, or where feet stand (in the rest hold, if there is one)."""
        if self._options.ground is not None:
            return self._options.ground
        if len(self._rest):
            return float(np.median(z[self._rest]))
        return float(np.median(z[self.standing])) if self.standing.any() else 0.0

    def _information(self) -> tuple[np.ndarray, ...]:
        o, standing = self._options, self.standing
        stays = np.zeros(standing.shape)
        stays[:-1] = (standing[:-1] & standing[1:]) / (o.slip**2 * self._step)
        share = min(1.0, self._step / _STANCE) / o.ground_sigma**2
        known = o.level and (o.ground is not None or len(self._rest) > 0 or standing.any())
        level = share if known else 0.0
        return stays, level * standing, level * ~standing

"""`ContactOptions`: feet that stand do not move, and floors are level."""

from __future__ import annotations

from dataclasses import dataclass

from mocap_jax.errors import InputError
from mocap_jax.residuals.robust import LOSSES, LossName


@dataclass(frozen=True)
class ContactOptions:
    """How points of the feet are held to the ground while they stand on it.

    Where nothing measures the root, this is what keeps it from drifting. Contacts are detected
    (see `contact.detect`) from boards on the feet before the first solve, and from the motion
    itself after every round.
    """

    slip: float = 0.01
    """How far a standing point wanders in a second [m/sqrt(s)]: shoes roll and deform, and joints
    of the foot are simplified."""
    loss: LossName = "geman_mcclure"
    """Robust loss: a contact that is none stops counting."""
    scale: float = 5.0
    """Its threshold, in standard deviations: 0.4 m/s at 60 Hz, with the default slip."""
    mu: tuple[float, ...] = (16.0, 4.0, 1.0)
    """Graduation of `geman_mcclure` over the rounds (Yang et al. 2020)."""
    level: bool = True
    """The ground is a horizontal plane: standing points are on it and no point is below it. Switch
    off for stairs and slopes (single steps are outliers, and do no harm)."""
    ground: float | None = None
    """Height of the sole of a standing foot in the world [m]; default: where feet stand in the
    declared rest hold, or in the whole recording where there is none."""
    ground_sigma: float = 0.02
    """Deviation of standing points from the plane, by stance [m]: points of the sole are guessed
    from the joints."""
    fastest: float = 0.4
    """A point that moves faster is not in contact [m/s]."""
    acceleration: float = 4.0
    """Nor one whose velocity, a mean over `window`, changes faster [m/s^2]: feet in the air slow
    down and speed up all the time, whatever the drift of the root."""
    turn: float = 0.6
    """Nor one on a foot whose board turns faster [rad/s]."""
    window: float = 0.08
    """[s]"""

    def __post_init__(self) -> None:
        for name in ("slip", "scale", "ground_sigma", "fastest", "acceleration", "turn", "window"):
            if not getattr(self, name) > 0:
                raise InputError(f"contacts: {name} {getattr(self, name):g}: must be above 0")
        if self.loss not in LOSSES:
            raise InputError(f"contacts: loss '{self.loss}'; valid: {', '.join(LOSSES)}")

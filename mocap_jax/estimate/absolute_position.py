"""Positions of the root or of a site from elsewhere (GPS, a camera, radio) as a residual.

Unlike `root="given"`, samples count at their own rate, not interpolated to all frames, and one that
is far off hardly counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body import Body, site_frames
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.estimate.sequence.user_residuals import UserResidual
from mocap_jax.recording import RootStream
from mocap_jax.residuals.robust import LossName, root_of_weight


@dataclass(frozen=True)
class _Position:
    """`UserResidual.function`: whitened and robust distance from a sample between two frames."""

    site: int | None
    """None: the origin of the root body, the first three coordinates."""
    sigma: tuple[float, float, float]
    loss: LossName
    scale: float

    def __call__(
        self, body: Body, q: Float[Array, "2 nq"], data: dict[str, Array]
    ) -> Float[Array, "m"]:
        known = data["known"][:, None]
        here, there = (self._place(body, q[i]) for i in (0, 1))
        share = data["share"][:, None]
        predicted = (1 - share) * here + share * there
        off = jnp.where(known, predicted - data["position"], 0.0) / jnp.array(self.sigma)
        return (off * root_of_weight(off, self.loss, self.scale)).ravel()

    def _place(self, body: Body, q: Float[Array, "nq"]) -> Float[Array, "3"]:
        return q[:3] if self.site is None else site_frames(body, q).position[self.site]


def absolute_position(
    stream: RootStream,
    time: Float[np.ndarray, "t"],
    body: Body,
    *,
    site: str | None = None,
    sigma: float | tuple[float, float, float] = 1.0,
    loss: LossName = "cauchy",
    scale: float = 3.0,
) -> tuple[UserResidual, dict[str, np.ndarray]]:
    """A residual for `OptimiseOptions.user_residuals`, and its data for `optimise`.

    Args:
        stream: positions in the world [m]; orientations are not used. NaN rows are left out.
        time: of the frames, `gather(recording, body).time` [s].
        body: the body, with a free root.
        site: whose position it is; default the root body's.
        sigma: standard deviation of a sample [m], one or for each of x, y, z. Errors of satellite
            positions last for minutes: to let a sample count for less, raise it.
        loss: robust loss.
        scale: its threshold, in standard deviations.

    Returns:
        The residual "position" (or "position/<site>") and its rows.

    Raises:
        InputError: no such site, a sigma not above zero, or no sample within the recording.
    """
    names = body.topology.site_names
    if site is not None and site not in names:
        raise unknown_name("site", site, names)
    each = tuple(float(x) for x in np.broadcast_to(sigma, 3))
    if not min(each) > 0:
        raise InputError(f"absolute position: sigma {min(each):g}: must be above 0")
    name = "position" if site is None else f"position/{site}"
    function = _Position(
        None if site is None else names.index(site), (each[0], each[1], each[2]), loss, scale
    )
    return UserResidual(name, function, 2), _rows(stream, np.asarray(time))


def _rows(stream: RootStream, time: np.ndarray) -> dict[str, np.ndarray]:
    """Samples (t, n) in the interval from each frame to the next, and where in it they are."""
    stamps, position = np.asarray(stream.time), np.asarray(stream.position)
    good = np.isfinite(position).all(1) & (stamps >= time[0]) & (stamps <= time[-1])
    if not good.any():
        raise InputError("absolute position: the stream has no sample within the recording")
    stamps, position = stamps[good], position[good]
    frame = (np.searchsorted(time, stamps, side="right") - 1).clip(0, len(time) - 2)
    order = np.argsort(frame, kind="stable")
    stamps, position, frame = stamps[order], position[order], frame[order]
    column = np.arange(len(frame)) - np.searchsorted(frame, frame)
    shape = (len(time), int(column.max()) + 1)
    known, share, at = np.zeros(shape, bool), np.zeros(shape), np.zeros((*shape, 3))
    known[frame, column], at[frame, column] = True, position
    share[frame, column] = (stamps - time[frame]) / (time[frame + 1] - time[frame])
    return {"known": known, "share": share, "position": at}

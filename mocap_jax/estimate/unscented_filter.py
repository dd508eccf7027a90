"""`ukf`: the unscented Kalman filter, beside the extended one."""

from __future__ import annotations

from mocap_jax.body import Body
from mocap_jax.estimate.filter import run_ekf
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.kalman import SigmaPoints
from mocap_jax.recording import Recording
from mocap_jax.solution import Solution


def ukf(
    recording: Recording,
    body: Body | None = None,
    *,
    options: EkfOptions = EkfOptions(),  # noqa: B008  (frozen)
    sigma_points: SigmaPoints = SigmaPoints(),  # noqa: B008  (frozen)
    progress: bool = False,
) -> Solution:
    """Estimate a motion frame by frame with an unscented Kalman filter.

    Measurements, noise and dynamics are those of `ekf` with the same options; what differs is that
    beliefs go through dynamics and measurements as sigma points and not by derivatives. It takes
    several times as long (a point for every one of 3 nv coordinates, both ways).

    Args:
        recording: measured streams and their set-up.
        body: nominal body whose sites carry the sensors; default the recording's own. It is given
            a free root if it has none.
        options: see `EkfOptions`. The backward pass of `smooth` goes from the filtered beliefs
            by the derivatives of the dynamics, which are linear but for turning ball joints.
        sigma_points: see `SigmaPoints`.
        progress: show a progress bar (stderr).

    Returns:
        Trajectory with velocities, pose covariances and innovation statistics.

    Raises:
        InputError: no body, unknown sensors, or `root="given"` without a measured root.
    """
    return run_ekf(recording, body, options, progress=progress, sigma_points=sigma_points)

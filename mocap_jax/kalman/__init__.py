"""Kalman filtering and smoothing of second-order motion on a manifold; knows no bodies."""

from mocap_jax.kalman.manifold import Manifold, vector_space
from mocap_jax.kalman.predict import (
    Dynamics,
    Process,
    butterworth_rate,
    predict,
    process_noise,
    transition,
)
from mocap_jax.kalman.smooth import smooth_pair, smooth_step
from mocap_jax.kalman.state import State
from mocap_jax.kalman.truncate import truncate
from mocap_jax.kalman.unscented import (
    SigmaPoints,
    predict_unscented,
    unscented_moments,
    update_unscented,
)
from mocap_jax.kalman.update import Innovation, apply, correct, update

__all__ = [
    "Dynamics", "Innovation", "Manifold", "Process", "SigmaPoints", "State", "apply",
    "butterworth_rate", "correct", "predict", "predict_unscented", "process_noise", "smooth_pair",
    "smooth_step", "transition", "truncate", "unscented_moments", "update", "update_unscented",
    "vector_space",
]  # fmt: skip

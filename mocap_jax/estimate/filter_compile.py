"""Compile the filter's programs in the background while the rest pose is estimated."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Any

import jax

from mocap_jax.body import Body
from mocap_jax.estimate.background import compile_once
from mocap_jax.estimate.filter_chunk import filter_chunk, smooth_chunk
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.estimate.filter_run import prepare
from mocap_jax.initialise import declared_rest
from mocap_jax.kalman import SigmaPoints
from mocap_jax.recording import Recording


def compile_filter(
    recording: Recording, body: Body, options: EkfOptions, use_root: bool,
    sigma_points: SigmaPoints | None = None,
) -> list[Future[None]]:  # fmt: skip
    """Queue the compilation of what the loops will call: [filter] or [filter, smoother].

    Nothing is queued for what looks like an earlier call.
    """
    key = (
        body.topology, options, use_root, tuple(recording.inertial), recording.ranges is None,
        sigma_points,
    )  # fmt: skip
    shapes: list[Any] = []

    def filtering() -> None:
        rest = declared_rest(recording, body, options.rest)
        run = prepare(recording, body, options, rest, use_root, sigma_points)
        results = filter_chunk.prepare(
            run.body, run.model, run.parameters, run.start, run.chunks[0]
        )
        shapes.extend([run._replace(chunks=run.chunks[:1]), *results])

    def smoothing() -> None:
        run, last, beliefs, _ = shapes
        smooth_chunk.prepare(
            run.body.topology, run.model.process, run.parameters.dynamics, beliefs,
            run.chunks[0].valid, last, jax.numpy.asarray(False), options.covariance,
            options.pair_covariance,
        )  # fmt: skip

    return compile_once(key, *(filtering, smoothing)[: 1 + options.smooth])

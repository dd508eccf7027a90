"""Measurements as the filter's loops take them: offsets removed, cut into equal chunks."""

from __future__ import annotations

import jax
import numpy as np
from jaxtyping import Float

from mocap_jax.estimate.filter_model import FrameInput
from mocap_jax.estimate.filter_options import EkfOptions
from mocap_jax.initialise import RestEstimate
from mocap_jax.measurement import FrameData


def filter_data(
    data: FrameData,
    magnetic: Float[np.ndarray, "t s 3"],
    rest: RestEstimate,
    options: EkfOptions,
    gravity: Float[np.ndarray, "t s 3"] | tuple[()] = (),
) -> tuple[list[FrameInput], str, tuple[int, ...]]:
    """Prepare the measurements.

    Returns:
        The chunks (the last one padded), the kinds that hold any data in the order of the
        updates (with R for the root), and the sites that take part in ranges.
    """
    accelerometer = np.asarray(data.accelerometer) - rest.accelerometer_bias
    gyroscope = np.asarray(data.gyroscope) - rest.gyroscope_bias
    if options.remove_averaging:
        accelerometer, gyroscope = without_averaging(accelerometer), without_averaging(gyroscope)
    weight = np.asarray(data.range_weight)
    source, receiver, sites = _places(data, weight > 0)
    t = len(data.time)
    whole = FrameInput(
        valid=np.ones(t, bool),
        first=np.arange(t) == 0,
        accelerometer=accelerometer,
        gyroscope=gyroscope,
        orientation=np.asarray(data.orientation),
        range_distance=np.asarray(data.range_distance),
        range_weight=weight,
        range_source=source,
        range_receiver=receiver,
        range_lead=np.asarray(data.range_lead),
        root_position=np.asarray(data.root_position),
        root_orientation=np.asarray(data.root_orientation),
        magnetic=magnetic,
        gravity=gravity,
    )
    held = {
        "O": np.isfinite(whole.orientation).any(),
        "G": np.isfinite(gyroscope).any(),
        "A": np.isfinite(accelerometer).any(),
        "D": (weight > 0).any(),
        "M": np.isfinite(magnetic).any(),
        "V": np.isfinite(gravity).any(),
        "R": np.isfinite(whole.root_position).any(),
    }
    kinds = "".join(kind for kind, any_data in held.items() if any_data)
    return _cut(whole, options.chunk), kinds, sites


def without_averaging(samples: np.ndarray) -> np.ndarray:
    """Values at the stamps of samples that are means over their intervals, to fourth order.

    Where a neighbour is missing the sample stays as it is.
    """
    correction = np.zeros_like(samples)
    correction[1:-1] = (samples[:-2] - 2 * samples[1:-1] + samples[2:]) / 24
    return samples - np.nan_to_num(correction)


def _places(data: FrameData, heard: np.ndarray) -> tuple[np.ndarray, np.ndarray, tuple[int, ...]]:
    """Sources and receivers as places in the list of all sites that take part."""
    source, receiver = np.asarray(data.range_source), np.asarray(data.range_receiver)
    sites = np.unique(np.concatenate([source[heard], receiver[heard]]))
    if not sites.size:
        return np.zeros_like(source), np.zeros_like(receiver), ()
    place = lambda at: np.where(heard, np.searchsorted(sites, at), 0)  # noqa: E731
    return place(source), place(receiver), tuple(int(s) for s in sites)


def _cut(whole: FrameInput, size: int) -> list[FrameInput]:
    t = len(whole.valid)
    count = -(-t // size)
    pad = count * size - t

    def chunks(x: np.ndarray) -> np.ndarray:
        filler = np.zeros((pad, *x.shape[1:]), x.dtype)
        return np.concatenate([x, filler]).reshape(count, size, *x.shape[1:])

    arrays = jax.tree.map(chunks, whole)
    return [jax.tree.map(lambda x, i=i: x[i], arrays) for i in range(count)]

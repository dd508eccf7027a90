"""The range stream: every pulse's detections at all boards."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mocap_jax.body.site_names import SOURCE_PREFIX
from mocap_jax.recording import RangeStream
from mocap_jax.signals.ultrasonic.air import temperature
from mocap_jax.simulation.flight import Flights, fly
from mocap_jax.simulation.hearing import HeardRanges, hear
from mocap_jax.simulation.options import SimulationOptions
from mocap_jax.simulation.profiles import Profile
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.rig import Rig
from mocap_jax.simulation.spline import PoseSpline
from mocap_jax.simulation.suit import Suit

_KELVIN = 273.15


def sample_ranges(
    rig: Rig,
    spline: PoseSpline,
    suit: Suit,
    profile: Profile,
    options: SimulationOptions,
    seed: int,
) -> tuple[RangeStream | None, dict[str, np.ndarray]]:
    """Ranges of all pulses, in order of emission, and the true acoustic parameters.

    Returns None for a suit without sources.
    """
    speed = true_speed(profile, options, seed)
    parameters = {"speed_of_sound": np.array(speed)}
    if not suit.source_sites:
        return None, parameters
    # The last pulse must arrive before the motion ends.
    end = spline.end - options.max_range_m / speed - options.pulse_interval_s
    flights = fly(
        rig, spline, end=end, pulse_interval=options.pulse_interval_s, speed_of_sound=speed,
        frequencies=suit.frequencies,
    )  # fmt: skip
    offset = true_offsets(suit, profile, seed)
    parameters |= offset_parameters(suit, offset)
    heard = _detections(flights, profile, options, seed)
    errors = thermometer_errors(suit, profile, seed)
    parameters |= thermometer_parameters(errors)
    kelvin = float(temperature(speed)) + _KELVIN
    scale = np.array([np.sqrt(1 + errors.get(name, 0.0) / kelvin) for name in suit.receiver_names])
    distance = heard.path * (options.speed_of_sound / speed * scale)
    distance = distance + offset[flights.source][:, None]
    if profile.white:
        noise = stream(seed, "range_noise").standard_normal(distance.shape)
        distance = distance + profile.stated.range * heard.jitter * noise
    kept = (heard.confidence > 0) & (distance > 0)
    if profile.loss:
        kept &= stream(seed, "range_loss").random(distance.shape) >= profile.loss
    pulse, receiver = np.nonzero(kept)
    ranges = RangeStream(
        time=flights.time[pulse],
        source=flights.source[pulse],
        receiver=receiver,
        distance=distance[pulse, receiver],
        confidence=heard.confidence[pulse, receiver],
        source_names=suit.source_sites,
        receiver_names=suit.receiver_names,
    )
    return ranges, parameters


def true_speed(profile: Profile, options: SimulationOptions, seed: int) -> float:
    """The real speed of sound [m/s]."""
    error = float(np.clip(stream(seed, "speed_of_sound").standard_normal(), -2.5, 2.5))
    return options.speed_of_sound * (1.0 + profile.speed_of_sound * error)


def thermometer_errors(suit: Suit, profile: Profile, seed: int) -> dict[str, float]:
    """By how much the thermometers of anchors that receive are wrong, by site name [K]."""
    return {
        name: float(
            profile.anchor_temperature * stream(seed, f"thermometer/{name}").standard_normal()
        )
        for name in suit.listening_anchors
    }


def thermometer_parameters(errors: Mapping[str, float]) -> dict[str, np.ndarray]:
    """These errors as parameters of the truth."""
    return {f"anchor_temperature/{name}": np.array(error) for name, error in errors.items()}


def true_offsets(suit: Suit, profile: Profile, seed: int) -> np.ndarray:
    """Constant error of each source's ranges [m]."""
    count = len(suit.source_sites)
    return profile.source_offset * stream(seed, "source_offset").standard_normal(count)


def offset_parameters(suit: Suit, offset: np.ndarray) -> dict[str, np.ndarray]:
    """These errors by name."""
    names = (s.removeprefix(SOURCE_PREFIX) for s in suit.source_sites)
    return {f"source_offset/{name}": x for name, x in zip(names, offset, strict=True)}


def _detections(
    flights: Flights, profile: Profile, options: SimulationOptions, seed: int
) -> HeardRanges:
    if profile.detector:
        return hear(
            flights, profile.hearing, stream(seed, "hearing"), max_range=options.max_range_m,
            multipath=profile.multipath,
        )  # fmt: skip
    visible = ~flights.occluded & (flights.cosine > 0) & (flights.distance <= options.max_range_m)
    ones = np.ones_like(flights.distance)
    return HeardRanges(flights.distance, ones, visible.astype(float), visible)

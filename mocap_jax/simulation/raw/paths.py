"""All ways of a pulse to a microphone: direct, around the body, off floor, walls and own limbs."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from mocap_jax.signals.ultrasonic.air import absorption, temperature
from mocap_jax.simulation.flight import Emissions, Flights
from mocap_jax.simulation.profiles import Profile
from mocap_jax.simulation.random_streams import stream
from mocap_jax.simulation.raw.options import RawOptions
from mocap_jax.simulation.raw.room import room_around
from mocap_jax.simulation.rig import Rig, place
from mocap_jax.simulation.spline import PoseSpline

_NEAREST = 0.05
_OFF_FLOOR = 0.01
"""Rays start and end this far from the floor and from devices [m]."""


@dataclass(frozen=True)
class Paths:
    """p ways of each of n pulses to r microphones."""

    length: Float[np.ndarray, "n r p"]
    """[m]"""
    amplitude: Float[np.ndarray, "n r p"]
    """Relative to the direct sound on the axis at 1 m."""


def trace_paths(
    rig: Rig,
    spline: PoseSpline,
    flights: Flights,
    emissions: Emissions,
    profile: Profile,
    options: RawOptions,
    speed: float,
    seed: int,
    frequencies: tuple[float, ...],
) -> Paths:
    """Ways of all pulses.

    Occluded direct sound leaks around the body as in `hearing`; in profiles without a detector
    there is nothing but the free direct sound.

    Args:
        rig: the true body with its devices.
        spline: its motion.
        flights: direct ways of all pulses.
        emissions: where the devices are.
        profile: what is heard of them.
        options: the room.
        speed: of sound [m/s].
        seed: of the random streams.
        frequencies: of the sources [Hz].
    """
    celsius = float(temperature(speed))
    absorbed = [float(absorption(f, celsius, options.humidity)) for f in frequencies]
    loss_db = np.array(absorbed)[flights.source][:, None, None]
    ways = [_direct(flights, emissions, profile, options, seed)]
    if profile.detector:
        ways.append(_body_echo(flights, profile, seed))
        ways += _reflections(rig, spline, flights, emissions, profile, options)
    length = np.stack([w[0] for w in ways], axis=2)
    gain = np.stack([w[1] for w in ways], axis=2)
    if profile.detector:
        fading = stream(seed, "raw_fading").standard_normal(flights.distance.shape)
        gain = gain * np.exp(profile.hearing.fading * fading)[..., None]
    spread = 10.0 ** (-loss_db * (length - 1.0) / 20.0) / np.maximum(length, _NEAREST)
    return Paths(length, gain * spread)


_Way = tuple[np.ndarray, np.ndarray]


def _direct(
    flights: Flights, emissions: Emissions, profile: Profile, options: RawOptions, seed: int
) -> _Way:
    """The direct sound, or what of it leaks around the body."""
    rng = stream(seed, "raw_leak")
    pairs = flights.distance.shape[1], int(flights.source.max()) + 1
    leak = rng.uniform(*profile.hearing.leak, pairs).T[flights.source]
    detour = rng.exponential(profile.hearing.detour, pairs).T[flights.source]
    if not profile.detector:
        leak, detour = np.zeros_like(leak), np.zeros_like(detour)
    beam = _beam(flights.cosine, profile.hearing.beam) * (flights.cosine > 0)
    heard = _beam(_cosine(emissions.outward, -emissions.way), options.microphone_beam)
    gain = beam * heard * np.where(flights.occluded, leak, 1.0)
    if profile.multipath:
        lost = stream(seed, "raw_lost").random(gain.shape) < profile.multipath
        gain = np.where(lost, 0.0, gain)
    return flights.distance + np.where(flights.occluded, detour, 0.0), gain


def _body_echo(flights: Flights, profile: Profile, seed: int) -> _Way:
    """The strongest reflection of the own limbs; it wanders slowly."""
    rng = stream(seed, "raw_echo")
    pairs = flights.distance.shape[1], int(flights.source.max()) + 1
    pick = lambda x: x.T[flights.source]  # noqa: E731
    gain = pick(rng.uniform(*profile.hearing.echo, pairs))
    rate, phase = pick(rng.uniform(0.1, 0.5, pairs)), pick(rng.uniform(0, 2 * np.pi, pairs))
    shortest, mean = profile.hearing.echo_detour
    swing = 1.0 + np.sin(2 * np.pi * rate * flights.time[:, None] + phase)
    return flights.distance + shortest + 0.5 * mean * swing, gain


def _reflections(
    rig: Rig,
    spline: PoseSpline,
    flights: Flights,
    emissions: Emissions,
    profile: Profile,
    options: RawOptions,
) -> list[_Way]:
    """Image sources behind floor, ceiling and four walls; the body hides the floor's only."""
    room = room_around(rig, spline, flights.source, emissions, options)
    length, gain, image = _mirrored(emissions, 2, room.floor, profile, options)
    hidden = _hidden_by_body(rig, spline, flights, emissions, image, room.floor)
    ways = [(length, options.floor_reflection * np.where(hidden, 0.0, gain))]
    for axis, place_m in room.others:
        length, gain, _ = _mirrored(emissions, axis, place_m, profile, options)
        ways.append((length, options.wall_reflection * gain))
    return ways


def _mirrored(
    emissions: Emissions, axis: int, plane: float, profile: Profile, options: RawOptions
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Length and gain of a reflection, and the position of the image source."""
    image, aim = emissions.origin.copy(), emissions.axis.copy()
    image[:, axis] = 2.0 * plane - image[:, axis]
    aim[:, axis] = -aim[:, axis]
    way = emissions.origin[:, None] + emissions.way - image[:, None]
    beam = _beam(_cosine(way, aim[:, None]), profile.hearing.beam)
    heard = _beam(_cosine(emissions.outward, -way), options.microphone_beam)
    return np.linalg.norm(way, axis=2), beam * heard, image


def _hidden_by_body(
    rig: Rig,
    spline: PoseSpline,
    flights: Flights,
    emissions: Emissions,
    image: Float[np.ndarray, "n 3"],
    floor: float,
) -> np.ndarray:
    """Whether the body stands in either leg of the way over the floor."""
    receivers = len(rig.microphone_sites)
    hidden = np.zeros(flights.distance.shape, bool)
    geom, reach = np.empty(receivers, np.int32), np.empty(receivers)
    one = np.empty(1, np.int32)
    for i, q in enumerate(spline.pose(flights.time)):
        place(rig, q)
        start = emissions.origin[i] + 0.02 * emissions.axis[i]
        microphone = emissions.origin[i] + emissions.way[i] + 0.02 * emissions.outward[i]
        share = (floor - image[i, 2]) / (microphone[:, 2] - image[i, 2])
        bounce = image[i] + np.clip(share, 0, 1)[:, None] * (microphone - image[i])
        leg = bounce - start
        length = np.maximum(np.linalg.norm(leg, axis=1), 1e-9)
        mujoco.mj_multiRay(
            rig.model, rig.data, start, (leg / length[:, None]).ravel(), None, False, -1, geom,
            reach, None, receivers, float(length.max()) + 0.1,
        )  # fmt: skip
        hidden[i] = (reach >= 0) & (reach < length - 0.01)
        for r in np.flatnonzero(~hidden[i]):
            up = microphone[r] - bounce[r]
            far = float(np.linalg.norm(up))
            if far < 2 * _OFF_FLOOR:  # a board that touches the floor
                continue
            up /= far
            hit = mujoco.mj_ray(
                rig.model, rig.data, bounce[r] + _OFF_FLOOR * up, up, None, False, -1, one
            )
            hidden[i, r] = 0 <= hit < far - 2 * _OFF_FLOOR
    return hidden


def _beam(cosine: np.ndarray, power: float) -> np.ndarray:
    return ((1.0 + np.clip(cosine, -1.0, 1.0)) / 2.0) ** power


def _cosine(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    lengths = np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1)
    return (a * b).sum(axis=-1) / np.maximum(lengths, 1e-12)

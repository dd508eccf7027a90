"""Measurements of a motion: simulated directly, or decoded from the wires' waveforms."""

from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from vlasic2007.cells import Cell

if TYPE_CHECKING:
    import mocap_jax as mj
    from mocap_jax.simulation import Profile


def recorded(motion: mj.Motion, cell: Cell) -> mj.Recording:
    """The recording that a cell's estimate is made from.

    `direct` is the profile as it stands. `raw` is what decoding makes of the waveforms. `wired` is
    simulated directly, with the noise that `raw` has: without what only boards on radio suffer
    (lost samples, clocks of their own), and with the round-off of telemetry.
    """
    import mocap_jax as mj
    from mocap_jax.decoding import with_round_off
    from mocap_jax.signals.telemetry.converter import ConverterScales
    from mocap_jax.simulation import PROFILES

    if cell.chain == "direct":
        return mj.simulate(motion, profile=cell.profile, seed=cell.seed)
    profile = dataclasses.replace(PROFILES[cell.profile], loss=0.0, clock_offset=0.0)
    if cell.chain == "wired":
        noise = with_round_off(profile.stated, ConverterScales())
        wired = dataclasses.replace(profile, stated=noise)
        return mj.simulate(motion, profile=wired, seed=cell.seed)
    return through_the_wires(motion, profile, cell.seed)


def through_the_wires(motion: mj.Motion, profile: Profile, seed: int) -> mj.Recording:
    """Simulate the driver box's samples, write them, decode the file."""
    from mocap_jax.decoding import decode_raw
    from mocap_jax.simulation.raw import simulate_raw

    raw = simulate_raw(motion, profile=profile, seed=seed)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "raw.mcap"
        raw.write(file)
        return decode_raw(file).recording

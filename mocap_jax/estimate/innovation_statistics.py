"""Innovation statistics per sensor and per source-receiver pair."""

from __future__ import annotations

import numpy as np

from mocap_jax.body import Body
from mocap_jax.estimate.filter_frame import FrameInput
from mocap_jax.kalman import Innovation
from mocap_jax.measurement import FrameData

_NAMES = {"A": "accelerometer", "G": "gyroscope", "O": "orientation"}


class InnovationStatistics:
    """Sums over chunks of whitened innovations; a well-tuned filter has an RMS of one."""

    def __init__(self, data: FrameData, body: Body, range_sites: tuple[int, ...]) -> None:
        self._sensors = data.sensors
        self._site_names = [body.topology.site_names[s] for s in range_sites]
        sensor_of = {site: name for name, site in zip(data.sensors, data.sites, strict=True)}
        self._range_names = [
            sensor_of.get(s, body.topology.site_names[s]).removeprefix("source/")
            for s in range_sites
        ]
        self._sums: dict[str, list[float]] = {}
        self.log_likelihood: dict[str, float] = {}
        """Of all innovations, by kind; the quantity that tuning maximises."""

    def add(self, frames: FrameInput, innovations: dict[str, Innovation]) -> int:
        """Take in a chunk; returns how many updates were skipped in it."""
        valid = np.asarray(frames.valid)
        skipped = 0
        for kind, innovation in innovations.items():
            skipped += int((~np.asarray(innovation.accepted) & valid).sum())
            likelihood = float(np.asarray(innovation.log_likelihood)[valid].sum())
            self.log_likelihood[kind] = self.log_likelihood.get(kind, 0.0) + likelihood
            whitened = np.asarray(innovation.whitened, float)
            if kind in _NAMES:
                self._add_sensors(kind, whitened.reshape(len(valid), -1, 3))
            elif kind == "R":
                self._put("root", whitened)
            else:
                self._add_ranges(frames, whitened)
        return skipped

    def _add_sensors(self, kind: str, whitened: np.ndarray) -> None:
        for i, sensor in enumerate(self._sensors):
            self._put(f"{_NAMES[kind]}/{sensor}", whitened[:, i])

    def _add_ranges(self, frames: FrameInput, whitened: np.ndarray) -> None:
        used = whitened != 0
        source, receiver = np.asarray(frames.range_source), np.asarray(frames.range_receiver)
        pair = source * len(self._range_names) + receiver
        for code in np.unique(pair[used]):
            s, r = divmod(int(code), len(self._range_names))
            name = f"range/{self._range_names[s]}-{self._range_names[r]}"
            self._put(name, whitened[used & (pair == code)])

    def _put(self, name: str, whitened: np.ndarray) -> None:
        # Inactive entries are exactly zero; measured ones practically never are.
        sums = self._sums.setdefault(name, [0.0, 0.0])
        sums[0] += float((whitened**2).sum())
        sums[1] += float((whitened != 0).sum())

    def table(self) -> dict[str, dict[str, float]]:
        """`{name: {"rms": ..., "count": ...}}` of all that was measured."""
        return {
            name: {"rms": float(np.sqrt(total / count)), "count": count}
            for name, (total, count) in sorted(self._sums.items())
            if count
        }

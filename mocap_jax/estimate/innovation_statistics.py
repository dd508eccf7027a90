"""Innovation statistics per sensor and per source-receiver pair."""

from __future__ import annotations

import numpy as np

from mocap_jax.body import Body
from mocap_jax.body.site_names import SOURCE_PREFIX
from mocap_jax.estimate.filter_model import FrameInput
from mocap_jax.kalman import Innovation
from mocap_jax.measurement import FrameData

_KINDS = {"D": "range", "R": "root"}
# Sensors have three values of these, but one of a heading and two of a tilt.
_AXES = {"M": 1, "V": 2}
_NAMES = {
    "M": "magnetometer", "V": "gravity", "A": "accelerometer", "G": "gyroscope",
    "O": "orientation",
}  # fmt: skip
# Whitened size beyond which a value counts as an outlier.
_OUTLIER = 3.0


class _Sums:
    """Of one stream, over chunks."""

    def __init__(self, axes: int) -> None:
        self.count = self.rows = self.outliers = self.lowered = self.heard = 0
        self.squared = 0.0
        self.total = np.zeros(axes)
        self.informed = np.zeros(axes)
        """Of innovations times their information (inverse variance)."""
        self.information = np.zeros(axes)


class InnovationStatistics:
    """Sums over chunks of innovations; a well-tuned filter has a whitened RMS of one."""

    def __init__(
        self, data: FrameData, body: Body, range_sites: tuple[int, ...], range_gate: float = 0.0
    ) -> None:
        self._sensors = data.sensors
        sensor_of = {site: name for name, site in zip(data.sensors, data.sites, strict=True)}
        self._range_names = [
            sensor_of.get(s, body.topology.site_names[s]).removeprefix(SOURCE_PREFIX)
            for s in range_sites
        ]
        # Beyond this whitened size `kalman.correct` leaves less than half of a range's weight.
        self._halved = range_gate * 2**0.25 if range_gate > 0 else np.inf
        self._sums: dict[str, _Sums] = {}
        self.log_likelihood: dict[str, float] = {}
        """Of all innovations, by kind; the quantity that tuning maximises."""
        self.normalised: dict[str, dict[str, float]] = {}
        """By kind as in `Solution.innovations`."""

    def add(self, frames: FrameInput, innovations: dict[str, Innovation]) -> int:
        """Take in a chunk; returns how many updates were skipped in it."""
        valid = np.asarray(frames.valid)
        skipped = 0
        for kind, innovation in innovations.items():
            skipped += int((~np.asarray(innovation.accepted) & valid).sum())
            likelihood = float(np.asarray(innovation.log_likelihood)[valid].sum())
            self.log_likelihood[kind] = self.log_likelihood.get(kind, 0.0) + likelihood
            self._normalise(kind, innovation, valid)
            whitened = np.asarray(innovation.whitened, float)
            plain = np.asarray(innovation.residual, float)
            if kind in _NAMES:
                shape = (len(valid), -1, _AXES.get(kind, 3))
                self._add_sensors(kind, whitened.reshape(shape), plain.reshape(shape))
            elif kind == "R":
                self._put("root", whitened, plain)
            else:
                self._add_ranges(frames, whitened, plain)
        return skipped

    def _normalise(self, kind: str, innovation: Innovation, valid: np.ndarray) -> None:
        """Add up normalised innovations squared of the updates that were made."""
        made = np.asarray(innovation.accepted) & valid
        # Inactive entries are exactly zero.
        count = int((np.asarray(innovation.whitened)[made] != 0).sum())
        if not count:
            return
        name = (_NAMES | _KINDS)[kind]
        sums = self.normalised.setdefault(name, {"squared": 0.0, "count": 0})
        sums["squared"] += float(np.asarray(innovation.nis, float)[made].sum())
        sums["count"] += count

    def _add_sensors(self, kind: str, whitened: np.ndarray, plain: np.ndarray) -> None:
        for i, sensor in enumerate(self._sensors):
            self._put(f"{_NAMES[kind]}/{sensor}", whitened[:, i], plain[:, i])

    def _add_ranges(self, frames: FrameInput, whitened: np.ndarray, plain: np.ndarray) -> None:
        heard = (np.asarray(frames.range_weight) > 0) & np.asarray(frames.valid)[:, None]
        source, receiver = np.asarray(frames.range_source), np.asarray(frames.range_receiver)
        pair = source * len(self._range_names) + receiver
        for code in np.unique(pair[heard]):
            s, r = divmod(int(code), len(self._range_names))
            name = f"range/{self._range_names[s]}-{self._range_names[r]}"
            chosen = heard & (pair == code)
            self._put(name, whitened[chosen][:, None], plain[chosen][:, None])
            self._sums[name].heard += int(chosen.sum())
            self._sums[name].lowered += int((np.abs(whitened[chosen]) > self._halved).sum())

    def _put(self, name: str, whitened: np.ndarray, plain: np.ndarray) -> None:
        """Add innovations of shape (t, axes)."""
        axes = whitened.shape[1]
        sums = self._sums.setdefault(name, _Sums(axes))
        # Inactive entries are exactly zero; measured ones practically never are.
        used = whitened != 0
        sums.count += int(used.sum())
        sums.rows += int(used.any(axis=1).sum())
        sums.squared += float((whitened**2).sum())
        sums.outliers += int((np.abs(whitened) > _OUTLIER).sum())
        sums.total += whitened.sum(axis=0)
        information = np.where(used, whitened / np.where(used, plain, 1.0), 0.0) ** 2
        sums.informed += (information * np.where(used, plain, 0.0)).sum(axis=0)
        sums.information += information.sum(axis=0)

    def table(self) -> dict[str, dict[str, float]]:
        """`{name: {"rms": ..., "count": ..., ...}}` of all that was measured.

        Keys as in `Solution.statistics`; a pair of which no range was used has its share alone.
        """
        return {name: _row(sums) for name, sums in sorted(self._sums.items())
                if sums.count or sums.heard}  # fmt: skip


def _row(sums: _Sums) -> dict[str, float]:
    row: dict[str, float] = {"count": sums.count}
    if sums.heard:
        row |= {"heard": sums.heard, "rejected": 1 - sums.count / sums.heard}
    if not sums.count:
        return row
    size = lambda x: float(x[0]) if len(x) == 1 else float(np.linalg.norm(x))  # noqa: E731
    row |= {
        "rms": float(np.sqrt(sums.squared / sums.count)),
        "rms_units": float(np.sqrt(sums.squared / sums.information.sum())),
        "bias": size(sums.total / sums.rows),
        "bias_units": size(sums.informed / np.maximum(sums.information, 1e-300)),
        "outliers": sums.outliers / sums.count,
    }
    return row | ({"lowered": sums.lowered / sums.count} if sums.heard else {})

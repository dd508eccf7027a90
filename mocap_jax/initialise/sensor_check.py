"""`SensorCheck`: what looks wrong with the sensors of a recording, for programs and for people."""

from __future__ import annotations

from dataclasses import dataclass, field

from mocap_jax.initialise.fault_groups import grouped_faults


@dataclass(frozen=True)
class SensorCheck:
    """What `check_sensors` found."""

    faults: dict[str, tuple[str, ...]]
    """Sensor -> what seems wrong with its units, scale or mounting, in sentences."""
    exchanged: tuple[tuple[str, ...], ...] = ()
    """Groups of sensors that seem swapped: each fits the place of the next in its group, and the
    last that of the first."""
    measures: dict[str, dict[str, float]] = field(default_factory=dict)
    """Sensor -> `gravity` [m/s^2] and `tilt_deg` (from the declared pose and mounting) at rest,
    `distance_error` (mean, at rest [m]), `rate_misfit` [m/s^2] (see `rate_factors`); NaN where
    there is nothing to tell."""
    remarks: tuple[str, ...] = ()
    """What could not be checked, and why."""
    inertial_only: tuple[tuple[str, ...], ...] = ()
    """Those groups of `exchanged` whose distances fit where they are: only the inertial data are
    exchanged, as by swapped cables."""
    ranges_only: tuple[tuple[str, ...], ...] = ()
    """Those whose inertial data fit where they are: only the distances are exchanged."""
    root: str | None = None
    """What seems wrong with the measured root's orientation."""

    @property
    def findings(self) -> dict[str, tuple[str, ...]]:
        """Sensor -> all that seems wrong with it; empty for a sensor without a finding."""
        out = {name: list(texts) for name, texts in self.faults.items()}
        for group in self.exchanged:
            for name, place in zip(group, (*group[1:], group[0]), strict=True):
                part = self._part(group)
                what = f"{part[0]} look swapped: they fit" if part else "looks swapped: it fits"
                out[name].insert(0, f"{what} the place of {place} clearly better")
        return {name: tuple(texts) for name, texts in out.items()}

    def _part(self, group: tuple[str, ...]) -> tuple[str, str, str] | None:
        """What of these sensors is exchanged, what is not, and how; None for all of them."""
        if group in self.inertial_only:
            how = "cables or names exchanged, or a gyroscope at fault?"
            return "inertial data", "distances", how
        if group in self.ranges_only:
            return (
                "distances",
                "inertial data",
                "cables or names of ultrasonic receivers exchanged?",
            )
        return None

    @property
    def ok(self) -> bool:
        """Whether nothing seems wrong."""
        return not self.exchanged and not any(self.faults.values()) and self.root is None

    @property
    def sentences(self) -> tuple[str, ...]:
        """All findings, each once, with the sensors named."""
        lines = []
        for group in self.exchanged:
            chain = [f"{a} fits the place of {b}" for a, b in zip(group, (*group[1:], group[0]),
                                                                  strict=True)]  # fmt: skip
            why = "each fits the other's place better" if len(group) == 2 else ", ".join(chain)
            swapped = " and ".join(group)
            if part := self._part(group):
                lines.append(
                    f"The {part[0]} of sensors {swapped} look swapped: {why}. Their {part[1]} "
                    f"fit where they are ({part[2]})."
                )
            else:
                lines.append(f"Sensors {swapped} look swapped: {why}.")
        root = () if self.root is None else (f"The measured root: {self.root}.",)
        return (*lines, *grouped_faults(self.faults), *root)

    def __str__(self) -> str:
        lines = self.sentences or ("No sensor looks swapped, turned or of wrong unit.",)
        return "\n".join([*lines, *self.remarks])

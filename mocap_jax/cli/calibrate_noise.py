"""`mocap-jax calibrate noise`: Allan deviation of inertial sensors that lie still."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from mocap_jax.cli.calibrate_kind import (
    Kinds,
    about,
    add_kind,
    add_outputs,
    check_outputs,
    warn,
    write_figures,
)
from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.cli.files import exit_code, output_file, read_input
from mocap_jax.cli.parser import positive_float

if TYPE_CHECKING:
    from mocap_jax.calibration import NoiseCalibration, SensorNoise

NOTE = """How to record: let the boards lie still, out of draughts and footsteps, for as long as you
can: an hour shows processes up to twelve minutes. The longest still interval of each board is used.

Method: overlapping Allan variances at averaging times of 1, 2, 4, ... samples, up to a fifth of the
interval, are fitted by white noise N^2/tau, bias instability (0.664 B)^2, random walk K^2 tau/3 and
round-off 3 Q^2/tau^2 (IEEE Std 952), each weighted by its degrees of freedom; what is below two
standard deviations is left out. Noise per sample, written to [noise], is the Allan deviation at one
sample, RMS over boards and axes."""
_UNITS = {
    "accelerometer": ("m/s^2", "m/s^1.5", "m/s^2.5"),
    "gyroscope": ("rad/s", "rad/s^0.5", "rad/s^1.5"),
}
_PLOTS = (".png", ".svg", ".pdf")


def add_parser(kinds: Kinds) -> None:
    """The parser of this kind."""
    parser = add_kind(
        kinds, "noise",
        summary="noise of inertial sensors from a still recording (Allan deviation)",
        example="mocap-jax calibrate noise still.mcap -o setup.toml --plot allan.png", note=NOTE,
        run=run,
    )  # fmt: skip
    parser.add_argument("recording", metavar="REC", help="recording (.mcap)")
    parser.add_argument(
        "--shortest", type=positive_float, default=60.0, metavar="S",
        help="shortest still interval that is used [s] (60)",
    )  # fmt: skip
    parser.add_argument("--plot", metavar="F", help="draw the curves to F (.png, .svg, .pdf)")
    add_outputs(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the kind."""
    check_outputs(arguments)
    plot = output_file(arguments.plot) if arguments.plot else None
    if plot is not None and plot.suffix.lower() not in _PLOTS:
        valid = ", ".join(_PLOTS)
        raise UsageError(f"--plot {plot}: unknown suffix '{plot.suffix}'; valid: {valid}")
    from mocap_jax.calibration import NoiseCalibrationOptions, calibrate_noise
    from mocap_jax.io import SetupFigures

    recording = read_input(arguments.recording)
    with about([arguments.recording]):
        found = calibrate_noise(recording, NoiseCalibrationOptions(arguments.shortest))
    print("\n".join(_table(found)))
    warn(found.skipped)
    results = {
        kind: {name: _json(noise) for name, noise in sensors.items()}
        for kind, sensors in found.sensors.items()
    }
    figures = SetupFigures(found.calibration, found.per_sample)
    write_figures(arguments, figures, {"kind": "noise", **results, "skipped": found.skipped})
    if plot is not None:
        from mocap_jax.report import write_allan_picture

        write_allan_picture(plot, found)
        print(f"wrote {plot}")
    return exit_code(recording)


def _table(found: NoiseCalibration) -> list[str]:
    lines = []
    for kind, sensors in found.sensors.items():
        if not sensors:
            continue
        unit, white, walk = _UNITS[kind]
        width = max(5, *(len(name) for name in sensors))
        lines += [
            f"{kind}: (-: none seen)",
            f"{'board':{width}s} axis  {f'a sample [{unit}]':>16s}  {f'white [{white}]':>21s}  "
            f"{f'instability [{unit}]':>21s}  {f'random walk [{walk}]':>22s}",
        ]
        for name, noise in sensors.items():
            for i, axis in enumerate("xyz"):
                lines.append(
                    f"{name if i == 0 else '':{width}s} {axis:4s}  {noise.per_sample[i]:16.3e}  "
                    + "  ".join(
                        f"{_number(size[i], sigma[i]):>{w}s}" for size, sigma, w in _columns(noise)
                    )
                )
            lines.append(f"{'':{width}s} {_facts(noise)}")
        lines.append(f"[noise] {kind} = {found.per_sample[kind]:.3e} {unit}")
    return lines


def _facts(noise: SensorNoise) -> str:
    lost = f", {100 * noise.missing:.1f} % of the samples interpolated" if noise.missing else ""
    return f"{noise.duration:.0f} s still at {noise.rate_hz:.1f} Hz{lost}"


def _columns(noise: SensorNoise) -> tuple[tuple[Any, Any, int], ...]:
    fit = noise.fit
    return (
        (fit.white, fit.sigma[0], 21),
        (fit.instability, fit.sigma[1], 21),
        (fit.random_walk, fit.sigma[2], 22),
    )


def _number(size: float, sigma: float) -> str:
    return f"{size:.2e} +- {sigma:.1e}" if size > 0 else "-"


def _json(noise: SensorNoise) -> dict[str, Any]:
    fit, curve = noise.fit, noise.curve
    sigma = [[None if s != s else float(s) for s in row] for row in fit.sigma]
    return {
        "per_sample": noise.per_sample.tolist(), "white": fit.white.tolist(),
        "instability": fit.instability.tolist(), "random_walk": fit.random_walk.tolist(),
        "quantisation": fit.quantisation.tolist(), "sigma": sigma, "rate_hz": noise.rate_hz,
        "duration_s": noise.duration, "missing": noise.missing, "tau_s": curve.tau.tolist(),
        "allan_deviation": curve.deviation.T.tolist(),
    }  # fmt: skip

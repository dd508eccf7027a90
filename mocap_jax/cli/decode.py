"""`mocap-jax decode`: a driver box's raw recording to calibrated measurements."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import unknown_choice
from mocap_jax.cli.files import exit_code, output_file
from mocap_jax.cli.parser import count, number_between
from mocap_jax.cli.setup_choice import add_setup_argument, corrected, setup_figures, warn_on_stderr

if TYPE_CHECKING:
    from mocap_jax.decoding import Decoded

SUMMARY = "decode a raw driver-box recording to distances and inertial readings"
EXAMPLE = "mocap-jax decode walk.raw.mcap -o walk.mcap"
NOTE = """detectors:
  matched      peak of a filter matched to the ultrasonic burst
  inflection   steepest rise of the power envelope, as published (Vlasic 2007)"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument("recording", metavar="RAW", help="raw recording (.mcap)")
    parser.add_argument("-o", "--output", metavar="REC", required=True, help="recording to write")
    parser.add_argument(
        "--detector", default=None, metavar="NAME",
        help="of ultrasonic arrivals: matched or inflection",
    )  # fmt: skip
    add_setup_argument(parser, "readings and distances are corrected by it")
    parser.add_argument(
        "--temperature", type=number_between(-60, 60), metavar="C",
        help="of the air [degrees Celsius]; default: as recorded, or the declared speed of sound",
    )  # fmt: skip
    parser.add_argument(
        "--humidity", type=number_between(0, 100), metavar="PERCENT",
        help="of the air, relative; default: dry (50 %% at 20 C: distances 0.2 %% longer)",
    )  # fmt: skip
    parser.add_argument("--workers", type=count, default=2, metavar="N", help="threads (default 2)")


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    output = output_file(arguments.output, (".mcap",))
    from tqdm import tqdm

    from mocap_jax.decoding import AirOptions, decode_raw
    from mocap_jax.io import write_recording
    from mocap_jax.signals.ultrasonic.arrivals import DETECTORS, DetectorOptions

    setup_figures(arguments)  # a fault in it is told before the work
    name = arguments.detector or DetectorOptions().detector
    if name not in DETECTORS:
        raise unknown_choice("--detector", "detector", name, DETECTORS)
    with tqdm(desc="decode", unit="B", unit_scale=True, disable=None) as bar:

        def show(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        decoded = decode_raw(
            arguments.recording, DetectorOptions(detector=name),
            air=AirOptions(arguments.temperature, arguments.humidity), workers=arguments.workers,
            progress=show,
        )  # fmt: skip
    decoded = replace(decoded, recording=corrected(arguments.setup, decoded.recording))
    write_recording(output, decoded.recording)
    print(f"{output}: {_heading(decoded)}, detector {name}")
    for line in _lines(decoded):
        print(f"  {line}")
    for remark in decoded.remarks + decoded.unheard:
        warn_on_stderr(remark)
    return exit_code(decoded.recording)


def _heading(decoded: Decoded) -> str:
    recording = decoded.recording
    (start, end), ranges = recording.interval, recording.ranges
    assert ranges is not None  # of a raw recording there are always some, if empty
    return (
        f"{end - start:.1f} s, {len(recording.inertial)} boards, {len(ranges.distance)} distances "
        f"of {decoded.slots} slots, {int((ranges.confidence > 0.5).sum())} with confidence above "
        "0.5"
    )


def _lines(decoded: Decoded) -> Iterator[str]:
    """What each board sent, and what is missing."""
    for board, found in decoded.boards.items():
        yield (
            f"{board}: {found.frames} frames, {found.lost} lost, {found.corrected_bits} bits "
            f"corrected, {found.overloaded} overloaded, {found.saturated} saturated"
        )
    for gap in decoded.gaps:
        yield f"{gap.wire}: no samples from {gap.start:.3f} s to {gap.end:.3f} s"
    if decoded.missing_pulses:
        yield f"{decoded.missing_pulses} pulses are not named between those that are"

"""`mocap-jax decode`: a driver box's raw recording to calibrated measurements."""

from __future__ import annotations

import argparse

from mocap_jax.cli.exit_codes import unknown_choice
from mocap_jax.cli.files import exit_code, output_file
from mocap_jax.cli.parser import count
from mocap_jax.cli.setup_choice import add_setup_argument, corrected, setup_figures

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
    parser.add_argument("--workers", type=count, default=2, metavar="N", help="threads (default 2)")


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    output = output_file(arguments.output, (".mcap",))
    from tqdm import tqdm

    from mocap_jax.decoding import decode_raw
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
            arguments.recording, DetectorOptions(detector=name), workers=arguments.workers,
            progress=show,
        )  # fmt: skip
    recording = corrected(arguments, decoded.recording)
    write_recording(output, recording)
    start, end = recording.interval
    ranges = recording.ranges
    print(
        f"{output}: {end - start:.1f} s, {len(recording.inertial)} boards, "
        f"{0 if ranges is None else len(ranges.distance)} distances of {decoded.slots} slots, "
        f"detector {name}"
    )
    for board, found in decoded.boards.items():
        print(
            f"  {board}: {found.frames} frames, {found.lost} lost, {found.corrected_bits} bits "
            f"corrected, {found.overloaded} overloaded, {found.saturated} saturated"
        )
    return exit_code(recording)

"""`mocap-jax cut`: a stretch of a recording as a recording of its own."""

from __future__ import annotations

import argparse
import sys

from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.cli.files import exit_code, output_file, read_input
from mocap_jax.cli.stretch import add_cut_arguments, cut_as_asked, cut_remarks

SUMMARY = "cut a stretch out of a recording"
EXAMPLE = "mocap-jax cut walk.mcap -o steps.mcap --from 3 --to 8"
NOTE = """Times stay seconds since the start of the whole recording, so that the stretch can be
compared with the whole. A rest hold keeps what lies inside (it is dropped where that is less
than 0.5 s)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument("recording", metavar="REC", help="recording (.mcap)")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help="recording to write")
    add_cut_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    output = output_file(arguments.output, (".mcap",))
    if arguments.start is None and arguments.stop is None:
        raise UsageError("cut: say where to cut: --from S, --to S or both")
    from mocap_jax.io import write_recording

    whole = read_input(arguments.recording)
    part = cut_as_asked(arguments, whole, arguments.recording)
    for remark in cut_remarks(whole, part):
        print(f"mocap-jax: warning: {arguments.recording}: {remark}", file=sys.stderr)
    write_recording(output, part)
    start, stop = part.interval
    print(
        f"{output}: {stop - start:.2f} s ({start:.2f} s to {stop:.2f} s), {len(part.inertial)} "
        f"inertial sensors"
    )
    return exit_code(whole)

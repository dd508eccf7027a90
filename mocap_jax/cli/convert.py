"""`mocap-jax convert`: other systems' recordings to MCAP."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import SALVAGED, SUCCESS, UsageError, unknown_choice
from mocap_jax.cli.files import output_file
from mocap_jax.cli.human_text import HUMAN_FORM, human_of, is_human, read_human
from mocap_jax.cli.parser import positive_float
from mocap_jax.cli.stretch import add_cut_arguments, cut_as_asked

if TYPE_CHECKING:
    from mocap_jax.body import Body
    from mocap_jax.conversion import Converted, ConvertOptions

SUMMARY = "convert another system's recording"
EXAMPLE = "mocap-jax convert IMUData --mapping myIMUMappings.xml -o walking.mcap"
FORMATS = {
    "xsens-mt": "text exports of Xsens MT Manager (a folder, or files)",
    "mvnx": "XML export of Xsens MVN",
    "x-io": "CSV exports of x-IMU3 or NGIMU (a folder a device)",
    "apdm": "HDF5 recording of APDM Opal",
    "apdm-csv": "CSV exports of APDM Opal (has to be named)",
    "mat": "MATLAB file, with a mapping of its variables or a preset",
    "totalcapture": ".sensors file of TotalCapture",
    "dip-imu": "pickle of DIP-IMU",
    "csv": "plain CSV, with a mapping of its columns",
}
NOTE = (
    "formats (recognised, unless --format names one):\n"
    + "\n".join(f"  {name:13s} {text}" for name, text in FORMATS.items())
    + """

Wrong units, quaternion order and direction, sign of gravity and exchanged sensors are looked for
at the end and told as warnings (errors with --strict), with the options that put them right.
docs/converting.md has an example for each format."""
)
_CHOICES = {
    "format": tuple(FORMATS),
    "accelerometer_unit": ("m/s^2", "g", "mg"),
    "gyroscope_unit": ("rad/s", "deg/s", "mdeg/s", "rev/s"),
    "magnetometer_unit": ("T", "mT", "uT", "nT", "G", "mG", "a.u."),
    "quaternion_order": ("wxyz", "xyzw"),
    "quaternion_direction": ("sensor-to-world", "world-to-sensor"),
    "gravity_sign": ("1", "-1"),
    "acceleration": ("specific-force", "free-world", "free-sensor"),
    "world_up": ("z", "y", "x", "-z"),
    "orientation": ("vqf", "vqf-magnetometer"),
}
_HELP = {
    "format": "of the source (default: found out)",
    "accelerometer_unit": "unit of accelerations",
    "gyroscope_unit": "unit of angular velocities",
    "magnetometer_unit": "unit of magnetic fields",
    "quaternion_order": "order of quaternions",
    "quaternion_direction": "what orientations map",
    "gravity_sign": "1: reads +g along up at rest; -1: along down",
    "acceleration": "what accelerations are: free ones have gravity removed",
    "world_up": "axis of the source's world that points up",
    "orientation": "estimate orientations where sensors measure none",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    parser.add_argument(
        "sources", metavar="SRC", nargs="+", help="file or folder, or files that belong together"
    )
    parser.add_argument("-o", "--output", metavar="REC", required=True, help="recording to write")
    parser.add_argument(
        "--mapping",
        metavar="FILE",
        help="which sensor is worn where (OpenSense .xml, .toml, .csv), what columns are (.toml), "
        "or a preset: qmt_full_body, broad",
    )
    parser.add_argument(
        "--body",
        metavar="XML",
        help="MJCF body, OpenSim model (.osim) or skeleton of joint positions (.json, .npz, .csv) "
        f"to wear the sensors as the mapping says, {HUMAN_FORM} (the built-in one) or 'mvn' (the "
        "character of an MVNX file); default: none",
    )
    parser.add_argument("--height", type=positive_float, metavar="M", help="of --body human (1.75)")
    parser.add_argument("--rate", type=positive_float, metavar="HZ", help="sampling rate")
    parser.add_argument("--trial", metavar="NAME", help="which trial of a folder with several")
    for key, choices in _CHOICES.items():
        parser.add_argument(
            f"--{key.replace('_', '-')}", metavar="NAME" if key == "format" else
            "|".join(choices), help=_HELP[key],
        )  # fmt: skip
    add_cut_arguments(parser)
    parser.add_argument("--strict", action="store_true", help="findings of the checks are errors")


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    output = output_file(arguments.output, (".mcap",))
    options = _options(arguments)
    from mocap_jax.conversion import converted
    from mocap_jax.io import write_recording

    result = converted(
        arguments.sources,
        format=arguments.format,
        mapping=arguments.mapping,
        body=_body(arguments),
        options=options,
        progress=sys.stderr.isatty(),
    )
    source = arguments.sources[0]
    recording = cut_as_asked(arguments, result.recording, source)
    for text in (*result.findings, *result.recording.salvage):
        print(f"mocap-jax: warning: {source}: {text}", file=sys.stderr)
    print(summary(dataclasses.replace(result, recording=recording)))
    write_recording(output, recording)
    print(f"wrote {output}")
    return SALVAGED if result.recording.salvage else SUCCESS


def summary(result: Converted) -> str:
    """What was converted, for people."""
    recording = result.recording
    facts, (start, end) = recording.setup.provenance, recording.interval
    lines = [
        f"{facts['source_format']}: {len(recording.inertial)} sensors, {end - start:.2f} s, "
        f"clock: {facts.get('clock', 'unknown')}"
    ]
    for spec in recording.setup.sensors:
        parts = [f"{spec.rate_hz:.6g} Hz", f"from {facts.get(f'sensor/{spec.name}', '?')}"]
        if segment := facts.get(f"segment/{spec.name}"):
            parts.append(f"on {segment}")
        lines.append(f"  {spec.name}: {', '.join(parts)}")
    lines.append(f"heading: {facts.get('heading', 'unknown')}")
    lines += [f"note: {text}" for text in result.remarks]
    return "\n".join(lines)


def _options(arguments: argparse.Namespace) -> ConvertOptions:
    for key, choices in _CHOICES.items():
        value = getattr(arguments, key)
        if value is not None and value not in choices:
            option = f"--{key.replace('_', '-')}"
            raise unknown_choice(option, key.replace("_", " "), value, choices)
    if arguments.height is not None and not is_human(arguments.body):
        raise UsageError("--height is for --body human")
    from mocap_jax.conversion import ConvertOptions

    sign = arguments.gravity_sign
    return ConvertOptions(
        rate_hz=arguments.rate,
        trial=arguments.trial,
        strict=arguments.strict,
        gravity_sign=None if sign is None else int(sign),
        **{k: getattr(arguments, k) for k in _CHOICES if k not in ("format", "gravity_sign")},
    )


def _body(arguments: argparse.Namespace) -> Body | str | None:
    if not is_human(arguments.body):
        return arguments.body
    size = read_human(arguments.body)
    if arguments.height is not None:
        if size.height is not None:
            raise UsageError(f"--height and --body {arguments.body}: height is given twice")
        size = size._replace(height=arguments.height)
    return human_of(size)

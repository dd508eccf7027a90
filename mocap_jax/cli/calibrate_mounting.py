"""`mocap-jax calibrate mounting`: how sensors sit on their segments, and their headings."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from mocap_jax.cli.calibrate_kind import about
from mocap_jax.cli.exit_codes import UsageError, unknown_choice
from mocap_jax.cli.files import exit_code, output_file, read_input, write_text
from mocap_jax.cli.human_text import HUMAN_FORM, human_of, is_human, read_human
from mocap_jax.cli.parser import add_json_argument, positive_float
from mocap_jax.cli.skeleton import check_body
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from mocap_jax.body import Body
    from mocap_jax.initialise import Heading
    from mocap_jax.recording import Recording

NAME = "mounting"
SUMMARY = "how sensors sit on their segments, and their headings, from a still second and motion"
EXAMPLE = "mocap-jax calibrate mounting walk.mcap --body human --height 1.80 -o worn.mcap"
NOTE = """The still second needs no T-pose: stand as the body's reference pose does (--pose
reference: upright, arms hanging), or write the pose to a file (--pose FILE.toml: joint = [numbers
in radians], as under [rest.pose] of setup.toml). Walk, turn or reach before or after it:
accelerations of the joints tell the sensors' headings, knees and elbows tell where the body faces.
Printed is what was found for each sensor, how sure it is, and which sensor disagrees."""
HEADINGS = ("auto", "own", "common")


def add_parser(kinds: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `calibrate mounting`."""
    parser = kinds.add_parser(
        NAME, help=SUMMARY, description=SUMMARY[0].upper() + SUMMARY[1:] + ".",
        epilog=f"example:\n  {EXAMPLE}\n\n{NOTE}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("recording", metavar="REC", help="recording (.mcap)")
    parser.add_argument(
        "-o", "--output", metavar="OUT", required=True, help="calibrated recording to write"
    )
    parser.add_argument(
        "--body",
        metavar="XML",
        help=f"MJCF body, OpenSim model (.osim) or {HUMAN_FORM} (the built-in one); default: the "
        "recording's",
    )
    parser.add_argument("--height", type=positive_float, metavar="M", help="of --body human (1.75)")
    parser.add_argument(
        "--segment", action="append", metavar="SENSOR=SEGMENT", default=[],
        help="where a sensor is worn, if the recording does not say (may be repeated; others are "
        "left out then)",
    )  # fmt: skip
    parser.add_argument(
        "--pose",
        metavar="NAME|FILE",
        help="in the still second: reference (the body's), declared (the recording's rest pose) or "
        "a TOML file of joints; default: declared, where there is one",
    )
    parser.add_argument(
        "--time", type=float, metavar="S", help="a moment of the still second (default: near the "
        "start)",
    )  # fmt: skip
    parser.add_argument(
        "--headings", metavar="|".join(HEADINGS), default="auto",
        help="own: each sensor's heading starts anywhere (no magnetometer); common: all have one; "
        "auto: as the recording says",
    )  # fmt: skip
    parser.add_argument(
        "--facing", metavar="SENSOR:AXIS", help="this axis (x, -x, ...) of this sensor points "
        "forward in the still second (default: as knees and elbows show)",
    )  # fmt: skip
    add_json_argument(parser)
    # SUPPRESS: a default here would undo what stood in front of the kind's name.
    parser.add_argument(
        "--traceback", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS
    )
    parser.set_defaults(calibrate=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the kind."""
    if arguments.headings not in HEADINGS:
        raise unknown_choice("--headings", "headings", arguments.headings, HEADINGS)
    output = output_file(arguments.output, (".mcap",))
    json_file = output_file(arguments.json) if arguments.json else None
    facing, segments = _facing(arguments.facing), _segments(arguments.segment)
    from mocap_jax.estimate.mounting import calibrate_mounting
    from mocap_jax.io import write_recording

    recording = read_input(arguments.recording)
    body = _body(arguments, recording)
    _check_names(segments, facing, recording, body)
    pose = _pose(arguments.pose, recording, body)
    with about([arguments.recording]), _time_asked_for():
        found = calibrate_mounting(
            recording, body, segments, pose=pose, time=arguments.time,
            headings=arguments.headings, facing=facing,
        )  # fmt: skip
    print(found)
    if json_file is not None:
        write_text(json_file, json.dumps(found.to_dict(), indent=2) + "\n")
    write_recording(output, found.recording)
    print(f"wrote {output}")
    return exit_code(recording)


def _facing(text: str | None) -> Heading | None:
    if text is None:
        return None
    sensor, colon, axis = text.rpartition(":")
    if not colon or not sensor or not axis:
        raise UsageError(f"--facing '{text}' is not SENSOR:AXIS, e.g. Pelvis:z")
    from mocap_jax.initialise import Heading

    return Heading(sensor, axis)


def _segments(entries: list[str]) -> dict[str, str] | None:
    out = {}
    for entry in entries:
        sensor, equals, segment = entry.partition("=")
        if not (sensor and equals and segment):
            raise UsageError(f"--segment '{entry}' is not SENSOR=SEGMENT, e.g. imu_1=Pelvis")
        out[sensor] = segment
    return out or None


def _check_names(
    segments: dict[str, str] | None, facing: Heading | None, recording: Recording, body: Body
) -> None:
    """Refuse sensors, segments and axes that are not there, by the option that names them."""
    from mocap_jax.initialise.orientation_calibration import AXES

    for sensor, segment in (segments or {}).items():
        if sensor not in recording.inertial:
            raise unknown_choice("--segment", "sensor", sensor, recording.inertial)
        if segment not in body.topology.body_names[1:]:
            raise unknown_choice("--segment", "segment", segment, body.topology.body_names[1:])
    if facing is None:
        return
    if facing.sensor not in (worn := segments or recording.inertial):
        raise unknown_choice("--facing", "sensor", facing.sensor, worn)
    if facing.axis not in AXES:
        raise unknown_choice("--facing", "axis", facing.axis, AXES)


@contextmanager
def _time_asked_for() -> Iterator[None]:
    """Name the option where the moment it asks for is no still one."""
    from mocap_jax.initialise.mounting import NotStillError

    try:
        yield
    except NotStillError as error:
        raise UsageError(f"--time: {error}") from error


def _body(arguments: argparse.Namespace, recording: Recording) -> Body:
    from mocap_jax.body import load_body

    if arguments.height is not None and not is_human(arguments.body):
        raise UsageError("--height is for --body human")
    if is_human(arguments.body):
        size = read_human(arguments.body)
        if arguments.height is not None and size.height is not None:
            raise UsageError(f"--height and --body {arguments.body}: height is given twice")
        return human_of(size if arguments.height is None else
                        size._replace(height=arguments.height))  # fmt: skip
    source = arguments.body or recording.body_xml
    if source is None:
        raise UsageError(f"{arguments.recording} carries no body; give one (--body XML, or human)")
    if arguments.body is not None:
        check_body(arguments.body)
    return load_body(source, free_root=True)


def _pose(choice: str | None, recording: Recording, body: Body) -> np.ndarray | None:
    """The pose asked for; None for the declared or reference one."""
    import dataclasses

    import numpy as np

    from mocap_jax.initialise import declared_pose
    from mocap_jax.io.setup_toml import read_pose
    from mocap_jax.recording import RestHold

    if choice is None:
        return None
    if choice == "reference":
        return np.asarray(body.qpos0)
    if choice == "declared":
        if recording.setup.rest is None:
            raise UsageError("--pose declared: the recording declares no rest hold")
        return declared_pose(recording.setup.rest, body)
    rest = dataclasses.replace(RestHold(0.0, 1.0), pose=read_pose(choice))
    try:
        return declared_pose(rest, body)
    except InputError as error:
        raise InputError(f"{choice}: {str(error).removeprefix('setup.toml: ')}") from error

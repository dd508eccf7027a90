"""Readings of one sensor in units that cannot be, or that disagree with each other."""

from __future__ import annotations

from mocap_jax.recording import InertialStream, Recording, Setup

_NAME = "stream"


def suspicions(stream: InertialStream) -> tuple[str, ...]:
    """What looks wrong with the readings, in sentences.

    Raises:
        InputError: readings of a size that no segment's motion has in m/s^2 and rad/s.
    """
    # Imported here: file formats and solvers of rest poses are slow to load.
    from mocap_jax.initialise import check_readings
    from mocap_jax.io.validate import validate_stream

    validate_stream(stream, "the inertial stream")
    recording = Recording(
        inertial={_NAME: stream}, ranges=None, root=None, magnetic={}, temperature=None,
        truth=None, setup=Setup(), body_xml=None,
    )  # fmt: skip
    return tuple(
        f"The sensor's {text}." for text in check_readings(recording).faults[_NAME]
        if text.startswith(("accelerometer", "gyroscope"))
    )  # fmt: skip

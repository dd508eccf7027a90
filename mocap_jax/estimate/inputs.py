"""What every estimator settles first: which body, and whether the measured root is used."""

from __future__ import annotations

import numpy as np

from mocap_jax.body import Body, load_body
from mocap_jax.errors import InputError
from mocap_jax.recording import Recording


def body_of(recording: Recording, body: Body | None) -> Body:
    """The given body, or the recording's own; with a free root.

    Raises:
        InputError: none is given and the recording has none.
    """
    if body is None:
        if recording.body_xml is None:
            raise InputError("the recording carries no body.xml: pass a body")
        return load_body(recording.body_xml, free_root=True)
    return body if body.has_free_root else load_body(body.xml, free_root=True)


def uses_root(recording: Recording, root: str) -> bool:
    """Whether the measured root is used under the option "auto", "given" or "free".

    Raises:
        InputError: "given", but the recording has no measured root.
    """
    if root == "given" and not measures_root(recording):
        raise InputError("root='given': the recording has no measured root (valid: auto, free)")
    return root != "free" and measures_root(recording)


def measures_root(recording: Recording) -> bool:
    """Whether the recording has a root that is not missing throughout; one half of it will do.

    Cameras often measure positions alone, and what is missing is left to the other sensors.
    """
    root = recording.root
    return root is not None and any(
        bool(np.isfinite(np.asarray(half)).all(axis=1).any())
        for half in (root.position, root.orientation)
    )


def measures_orientation(recording: Recording) -> bool:
    """Whether any board reports its orientation."""
    boards = recording.inertial.values()
    return any(np.isfinite(np.asarray(board.orientation)).any() for board in boards)


def measured_kinds(recording: Recording) -> tuple[str, ...]:
    """Letters of the kinds of measurements that a recording has; magnetic fields aside."""
    boards = recording.inertial.values()
    there = {
        letter: any(np.isfinite(np.asarray(getattr(board, name))).any() for board in boards)
        for letter, name in (("A", "accelerometer"), ("G", "gyroscope"), ("O", "orientation"))
    }
    there["D"] = recording.ranges is not None and len(recording.ranges.time) > 0
    return tuple(letter for letter in "AGDO" if there[letter])


def mounting_remarks(recording: Recording) -> tuple[str, ...]:
    """What to say of a recording whose sensors nobody has aligned with their segments."""
    stated = str(recording.setup.provenance.get("mounting", ""))
    if not stated.startswith("nominal"):
        return ()
    return (
        f"Mounting is {stated}. Joint angles are wrong by as much as the sensors are turned on "
        "their segments, often by 90 degrees: calibrate first (mocap-jax calibrate mounting, or "
        "calibrate_mounting and calibrate_to_pose in Python).",
    )

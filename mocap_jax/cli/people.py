"""Several people in one recording: `simulate MOTION --with MOTION --place X,Y,DEGREES`."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mocap_jax.cli.exit_codes import UsageError
from mocap_jax.cli.motion_choice import FILE_OPTIONS, chosen_motion
from mocap_jax.cli.people_frequencies import FREQUENCIES, tuned
from mocap_jax.cli.simulation_choices import simulation_options
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.body import Body
    from mocap_jax.motion import Motion
    from mocap_jax.simulation import Suit

NAMES = "abcdefgh"
"""Of the people: prefixes of all names."""
_NEAREST_ROOTS = 0.2
"""People whose roots come nearer stand in each other [m]."""
_BODY_OPTIONS = ("height", "mass", "sex", "length")

SuitOf = Callable[[argparse.Namespace, "Body"], "Suit | None"]


def add_people_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments about the people beside the first."""
    group = parser.add_argument_group(
        "several people",
        "They are a (who performs MOTION), b, c, ...; all wear the suit of --sensors, whose\n"
        "anchors stand in the room once. Options of MOTION's file and body are for a alone; those\n"
        "of the others are given once for each --with, in their order (- where one needs none).",
    )
    group.add_argument(
        "--with", dest="others", action="append", default=[], metavar="MOTION",
        help="what another person performs at the same time (may be repeated)",
    )  # fmt: skip
    group.add_argument(
        "--place", dest="places", action="append", type=_place, default=[], metavar="X,Y[,DEG]",
        help="turn a --with motion about the vertical [deg], then move it [m]; one for each, in "
        "their order (--place=-1,0 where X is negative); default: where their files have them",
    )  # fmt: skip
    group.add_argument(
        "--with-body", dest="other_bodies", action="append", default=[], metavar="XML",
        help="body of a --with motion, as --body is of MOTION; one for each, in their order",
    )  # fmt: skip
    for option, kind, metavar in FILE_OPTIONS:
        group.add_argument(
            f"--with-{option}", dest=f"with_{option}", action="append", type=_or_none(kind),
            default=[], metavar=metavar, help=f"of a --with motion, as --{option} is of MOTION",
        )  # fmt: skip
    group.add_argument(
        "--frequencies", type=_frequencies, metavar="HZ,HZ,...",
        help="of everybody's ultrasonic sources; different ones sound at the same time, equal ones "
        "take turns (default: a's as the suit has them; for each of the others the first of 40000, "
        "33000, 47000 that is 5000 from all before and from the anchors')",
    )  # fmt: skip


def check_people(arguments: argparse.Namespace) -> None:
    """Refuse options that do not go together.

    Raises:
        UsageError: naming the option.
    """
    others = len(arguments.others)
    for option, given in (
        ("--place", arguments.places), ("--with-body", arguments.other_bodies),
        ("--frequencies", arguments.frequencies),
        *((f"--with-{o}", getattr(arguments, f"with_{o}")) for o, _, _ in FILE_OPTIONS),
    ):  # fmt: skip
        if given and not others:
            raise UsageError(f"{option} is for several people: name the others by --with MOTION")
        count = others + (option == "--frequencies")
        if given and len(given) != count:
            raise UsageError(f"{option} is given for {len(given)} of {count} people")
    if others >= len(NAMES):
        raise UsageError(f"--with: {others + 1} people; at most {len(NAMES)} have names")
    if others >= len(FREQUENCIES) and not arguments.frequencies:
        raise UsageError(
            f"--with: {others + 1} people; say the --frequencies of their sources, of which "
            f"{len(FREQUENCIES)} are known"
        )


def people(arguments: argparse.Namespace, first: Motion, suit_of: SuitOf) -> tuple[Motion, Suit]:
    """One motion and one suit of everybody.

    Args:
        arguments: of the verb, checked.
        first: the motion of MOTION.
        suit_of: the suit of `--sensors` on a body; None for the standard one.

    Raises:
        UsageError: people that stand in each other, or motions that do not go together.
        InputError: a motion, body or suit that cannot be used.
    """
    from mocap_jax.motion import together
    from mocap_jax.simulation import default_suit, suits_together
    from mocap_jax.simulation.mounting import with_shapes

    motions = dict(zip(NAMES, [first, *_others(arguments)], strict=False))
    motions = {name: replace(m, body=with_shapes(m.body)) for name, m in motions.items()}
    motions = _of_one_rate(motions, simulation_options(arguments).fastest_joint)
    suits = {n: suit_of(arguments, m.body) or default_suit(m.body) for n, m in motions.items()}
    anchors = suits["a"].anchors  # they stand in the world, once
    suits = {name: replace(suit, anchors=()) for name, suit in suits.items()}
    try:
        both = together(motions, dict(zip(NAMES[1:], arguments.places, strict=False)))
    except InputError as error:
        raise UsageError(f"--with: {str(error).removeprefix('together: ')}") from error
    _check_apart(both, [m.body.nq for m in motions.values()])
    return both, suits_together(tuned(suits, anchors, arguments.frequencies), anchors)


def _others(arguments: argparse.Namespace) -> list[Motion]:
    """Motions of all but the first."""
    return [_other(arguments, i) for i in range(len(arguments.others))]


def _other(arguments: argparse.Namespace, index: int) -> Motion:
    """Motion of one of them; raises `UsageError` that names the option of the others."""
    own = argparse.Namespace(**vars(arguments))
    own.motion = arguments.others[index]
    own.body = arguments.other_bodies[index] if arguments.other_bodies else None
    for option in _BODY_OPTIONS:
        setattr(own, option, None)
    for option, _, _ in FILE_OPTIONS:
        given = getattr(arguments, f"with_{option}")
        setattr(own, option, given[index] if given else None)
    try:
        return chosen_motion(own)
    except UsageError as error:
        raise UsageError(_of_the_others(str(error), own.body)) from error


def _of_the_others(text: str, body: str | None) -> str:
    """A fault that begins with an option of MOTION, by the option of `--with` that is meant."""
    for option in ("body", *(o for o, _, _ in FILE_OPTIONS)):
        text = re.sub(f"^--{option} ", f"--with-{option} ", text)
    # What makes a human has no options of its own here: it stands in the text of the body.
    return re.sub(f"^--({'|'.join(_BODY_OPTIONS)}): ", lambda _: f"--with-body {body}: ", text)


def _of_one_rate(motions: dict[str, Motion], fastest_joint: float) -> dict[str, Motion]:
    """All at the lowest of their frame rates; prints whose was changed."""
    from mocap_jax.simulation import frame_rate, same_rate

    out = same_rate(motions, fastest_joint)
    for name, motion in motions.items():
        if out[name] is not motion:
            print(
                f"{name}: {motion.name} has {frame_rate(motion):.6g} frames a second; brought to "
                f"{frame_rate(out[name]):.6g}, the lowest rate of all"
            )
    return out


def _check_apart(both: Motion, widths: list[int]) -> None:
    """Refuse people whose roots meet; raises `UsageError`.

    Args:
        both: everybody's motion.
        widths: numbers of each person's coordinates, the root's first; things that they carry may
            be free as well.
    """
    import numpy as np

    q = np.asarray(both.trajectory.q)
    starts = np.cumsum([0, *widths[:-1]])
    for i, start in enumerate(starts):
        for j, other in enumerate(starts[:i]):
            way = q[:, start : start + 3] - q[:, other : other + 3]
            distance = np.linalg.norm(way, axis=1)
            when, nearest = both.trajectory.time[distance.argmin()], float(distance.min())
            if nearest < _NEAREST_ROOTS:
                raise UsageError(
                    f"--place: {NAMES[j]} and {NAMES[i]} stand in each other (roots {nearest:.2f} "
                    f"m apart at {when:.2f} s); move {NAMES[i]}, as --place 1.5,0,180 does"
                )


def _or_none(kind: Callable[[str], Any]) -> Callable[[str], Any]:
    """An argparse type that reads - as nothing."""

    def read(text: str) -> Any:
        return None if text == "-" else kind(text)

    return read


def _place(text: str) -> tuple[float, float, float]:
    """Read X,Y or X,Y,DEGREES (an argparse type); the turn comes out in radians."""
    values = _numbers(text)
    if len(values) not in (2, 3):
        raise argparse.ArgumentTypeError(f"'{text}' is not X,Y or X,Y,DEGREES")
    x, y, turn = (*values, 0.0)[:3]
    return x, y, math.radians(turn)


def _frequencies(text: str) -> tuple[float, ...]:
    """Read frequencies separated by commas (an argparse type)."""
    values = _numbers(text)
    if not values or min(values) <= 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of numbers above zero")
    return values


def _numbers(text: str) -> tuple[float, ...]:
    """Finite numbers separated by commas; none where some part is no such number."""
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        return ()
    return values if all(map(math.isfinite, values)) else ()

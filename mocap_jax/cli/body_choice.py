"""Arguments that choose who performs a motion: an MJCF body or the built-in human."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import UsageError, unknown_choice, value_of
from mocap_jax.cli.human_text import HUMAN, HUMAN_FORM, HumanSize, human_of, is_human, read_human
from mocap_jax.cli.parser import positive_float
from mocap_jax.cli.skeleton import check_body, read_body
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.body import Body
    from mocap_jax.motion import Motion

LIKE_CLIP = "human-like-clip"
_OPTIONS = ("height", "mass", "sex", "length")


def add_body_arguments(parser: argparse.ArgumentParser) -> None:
    """`--body` and what the built-in human is made from."""
    parser.add_argument(
        "--body",
        metavar="XML",
        help="retarget the motion to this MJCF body, OpenSim model (.osim) or skeleton of joint "
        f"positions (.json, .npz, .csv), to {HUMAN_FORM} (the built-in one) or to '{LIKE_CLIP}' "
        "(with the clip's segment lengths); default: its own",
    )
    parser.add_argument("--height", type=positive_float, metavar="M", help="stature of the human")
    parser.add_argument("--mass", type=positive_float, metavar="KG", help="its mass")
    parser.add_argument(
        "--sex", type=str.lower, metavar="SEX", help="female or male (default: mean of both)"
    )
    parser.add_argument(
        "--length",
        action="append",
        metavar="SEGMENT=M",
        help="another length of a segment of the human, e.g. UpperLeg=0.45 (may be repeated)",
    )


def chosen_body(arguments: argparse.Namespace, motion: Motion | None = None) -> Body | None:
    """The body asked for; None for the motion's own.

    Raises:
        UsageError: options that do not go together, or a wrong value.
        InputError: a wrong file.
    """
    given = [o for o in _OPTIONS if getattr(arguments, o) is not None]
    if arguments.sex is not None:
        _check_sex(arguments.sex)
    if arguments.body == LIKE_CLIP:
        return _like_clip(arguments, motion, given)
    # A built-in motion is the human's own anyway.
    if is_human(arguments.body) or (arguments.body is None and motion is None and given):
        return _human(arguments)
    if given:
        raise UsageError(f"--{given[0]} is for --body {HUMAN}")
    if arguments.body is None:
        return None
    check_body(arguments.body)
    return read_body(arguments.body, free_root=True)


def _check_sex(sex: str) -> None:
    from mocap_jax.motion.human import SEXES

    if sex not in SEXES:
        raise unknown_choice("--sex", "sex", sex, SEXES)


def _human(arguments: argparse.Namespace) -> Body:
    size = read_human(arguments.body or HUMAN)
    for option in ("height", "mass", "sex"):
        if getattr(arguments, option) is not None and getattr(size, option) is not None:
            raise UsageError(f"--{option} and --body {arguments.body}: {option} is given twice")
    with value_of("--length"):
        lengths = _lengths(arguments.length or [])
    return human_of(HumanSize(
        arguments.height if size.height is None else size.height,
        arguments.mass if size.mass is None else size.mass,
        arguments.sex if size.sex is None else size.sex, {**size.lengths, **lengths},
    ))  # fmt: skip


def _like_clip(arguments: argparse.Namespace, motion: Motion | None, given: list[str]) -> Body:
    if motion is None:
        raise UsageError(f"--body {LIKE_CLIP} is for motion files; built-in motions use {HUMAN}")
    if unused := [o for o in given if o in ("height", "length")]:
        raise UsageError(f"--{unused[0]} does not go with --body {LIKE_CLIP}")
    from mocap_jax.motion import human_like
    from mocap_jax.motion.human import check_size

    if arguments.mass is not None:
        with value_of("--mass"):
            check_size(mass=arguments.mass)
    return human_like(motion.body, arguments.mass, arguments.sex)


def _lengths(texts: list[str]) -> dict[str, float]:
    lengths = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            lengths[name] = float(value)
        except ValueError as error:
            raise InputError(
                f"'{text}': expected SEGMENT=METRES, for example UpperLeg=0.45"
            ) from error
    return lengths

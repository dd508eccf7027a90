"""The built-in human as the value of `--body`: `human:height=1.80,mass=75,sex=f,UpperLeg=0.45`."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from mocap_jax.cli.exit_codes import UsageError, value_of

if TYPE_CHECKING:
    from mocap_jax.body import Body

HUMAN = "human"
HUMAN_FORM = f"{HUMAN} or {HUMAN}:height=1.80,mass=75,sex=f,UpperLeg=0.45"
_SEXES = {"f": "female", "m": "male", "female": "female", "male": "male"}


class HumanSize(NamedTuple):
    """What the built-in human is made from; None for the usual."""

    height: float | None = None
    """[m]"""
    mass: float | None = None
    """[kg]"""
    sex: str | None = None
    lengths: dict[str, float] = {}
    """Of segments [m]."""


def is_human(text: str | None) -> bool:
    """Whether a value of `--body` means the built-in human."""
    return text is not None and text.partition(":")[0] == HUMAN


def read_human(text: str) -> HumanSize:
    """Read `human` or `human:KEY=VALUE,...`.

    Raises:
        UsageError: naming the part that cannot be read and what is expected.
    """
    _, colon, rest = text.partition(":")
    numbers: dict[str, float] = {}
    sex = None
    for part in rest.split(",") if colon else ():
        key, _, value = (x.strip() for x in part.partition("="))
        if key in numbers or (key == "sex" and sex is not None):
            raise UsageError(f"--body {text}: {key} is given twice")
        if key == "sex":
            sex = _sex(text, value)
            continue
        try:
            numbers[key] = float(value)
        except ValueError as error:
            raise UsageError(
                f"--body {text}: '{part}' cannot be read; expected height=METRES, mass=KILOGRAMS, "
                "sex=female or male, or SEGMENT=METRES, separated by commas"
            ) from error
    height, mass = numbers.pop("height", None), numbers.pop("mass", None)
    return HumanSize(height, mass, sex, numbers)


def human_of(size: HumanSize, lengths_from: str = "--length") -> Body:
    """The body; of average build for its height where no mass is given.

    Args:
        size: what to make it from.
        lengths_from: what the user wrote lengths of segments in.

    Raises:
        UsageError: a value outside its range, an unknown sex or segment.
    """
    from mocap_jax.motion import human
    from mocap_jax.motion.human import check_size

    height = 1.75 if size.height is None else size.height
    mass = 70.0 * (height / 1.75) ** 2 if size.mass is None else size.mass
    with value_of("--height"):
        check_size(height=height)
    with value_of("--mass"):
        check_size(mass=mass)
    with value_of(lengths_from):
        return human(height, mass, size.sex, size.lengths)


def _sex(text: str, value: str) -> str:
    if value.lower() not in _SEXES:
        raise UsageError(f"--body {text}: unknown sex '{value}'; valid: f, m, female, male")
    return _SEXES[value.lower()]

"""`mocap-jax place`: where sensors should go on a body, for a set of motions."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mocap_jax.cli.body_choice import add_body_arguments, chosen_body
from mocap_jax.cli.exit_codes import SUCCESS, UsageError, unknown_choice, value_of
from mocap_jax.cli.files import output_folder, write_text
from mocap_jax.cli.human_text import is_human
from mocap_jax.cli.parser import count, number_between, positive_count, positive_float
from mocap_jax.cli.place_sources import check_sources, with_sources
from mocap_jax.cli.setup_choice import add_setup_argument, setup_figures
from mocap_jax.cli.stretch import named_stretch, with_stretch
from mocap_jax.errors import InputError

if TYPE_CHECKING:
    from mocap_jax.body import Body
    from mocap_jax.motion import Motion
    from mocap_jax.placement import PlacementOptions, PlacementStudy
    from mocap_jax.recording import NoiseFigures

SUMMARY = "choose where sensors go on a body for a set of motions"
EXAMPLE = "mocap-jax place routine:4-9 walking:2-7 -n 6 -o placement --symmetric"
NOTE = (
    "A motion is a file (.amc with its .asf beside it, .bvh, .npz) or a built-in motion (routine,\n"
    "walking); NAME:START-END takes a stretch of it in seconds. Written are placementK.toml (for\n"
    "simulate --sensors) and placementK.xml (the body with the sensors, for reconstruct --body)\n"
    "of every rank K, placement.png and study.json."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the verb."""
    _add_sensors(parser)
    _add_criterion(parser)
    _add_constraints(parser)
    _add_search(parser)
    add_body_arguments(parser)


def _add_sensors(parser: argparse.ArgumentParser) -> None:
    """What for, where to, how many of which kind."""
    parser.add_argument(
        "motions", metavar="MOTION", nargs="+", help="what sensors should be good for"
    )
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write")
    parser.add_argument(
        "-n", "--number", type=positive_count, default=6, metavar="N", help="sensors (6)"
    )
    parser.add_argument(
        "--most", type=count, metavar="N", help="end of the curve of error by number (N + 2)"
    )
    parser.add_argument(
        "--sensors", default="AG", metavar="KINDS", help="what a sensor measures: A, G or AG (AG)"
    )
    add_setup_argument(parser, "those of [noise] are the sensor's (default: Vlasic 2007)")
    parser.add_argument(
        "--sources", type=positive_count, metavar="N",
        help="ultrasonic sources for the best placement, chosen among the standard suit's: always "
        "by the mean squared error of joint centres over the mean of the motions",
    )  # fmt: skip


def _add_criterion(parser: argparse.ArgumentParser) -> None:
    """Which errors are made small."""
    parser.add_argument(
        "--quantity", default="position", metavar="NAME",
        help="errors of what: position (of joint centres; default) or orientation (of segments)",
    )  # fmt: skip
    parser.add_argument(
        "--joints", metavar="SEGMENTS", help="which of them count (all), separated by commas"
    )
    parser.add_argument(
        "--objective", default="A", metavar="NAME",
        help="A (mean squared error; default), D (volume), E (worst direction), worst (joint)",
    )  # fmt: skip
    parser.add_argument(
        "--over", default="mean", metavar="NAME", help="motions: mean (default) or worst"
    )
    parser.add_argument(
        "--root", default="given", metavar="NAME", help="root pose: given (default) or free"
    )


def _add_constraints(parser: argparse.ArgumentParser) -> None:
    """What a placement must respect."""
    parser.add_argument("--symmetric", action="store_true", help="left and right alike")
    parser.add_argument(
        "--allow", metavar="SEGMENTS", help="segments that may carry one, separated by commas"
    )
    parser.add_argument("--require", metavar="SEGMENTS", help="segments that must carry one")
    parser.add_argument(
        "--cost", action="append", metavar="SEGMENT=COST", help="of a sensor there (1 elsewhere)"
    )
    parser.add_argument("--budget", type=positive_float, metavar="COST", help="largest total cost")
    parser.add_argument(
        "--wire", type=positive_float, metavar="M", help="longest total wire, along the body"
    )
    parser.add_argument("--hub", metavar="SEGMENT", help="where the wires of --wire end (Pelvis)")
    parser.add_argument(
        "--distance", type=number_between(0, 1), default=0.05, metavar="M",
        help="least distance between two sensors (0.05)",
    )  # fmt: skip


def _add_search(parser: argparse.ArgumentParser) -> None:
    """How hard to search."""
    parser.add_argument(
        "--restarts", type=positive_count, default=3, metavar="N", help="starts (3)"
    )
    parser.add_argument("--steps", type=count, default=25, metavar="N", help="of each start (25)")
    parser.add_argument(
        "--evaluations",
        type=positive_count,
        default=400,
        metavar="N",
        help="choices of segments (400)",
    )
    parser.add_argument("--seed", type=count, default=0, metavar="N", help="of random starts")


def run(arguments: argparse.Namespace) -> int:
    """Run the verb."""
    from mocap_jax.placement import DistanceError, place, study_record, write_placement
    from mocap_jax.report import write_placement_picture

    _check_choices(arguments)
    options = _options(arguments)
    motions = [_motion(text, arguments) for text in arguments.motions]
    body = motions[0].body
    _check_segments(options, body)
    check_sources(arguments.sources, body)
    folder = output_folder(arguments.output)
    try:
        study = place(body, motions, options, progress=sys.stderr.isatty())
    except DistanceError as error:
        raise UsageError(f"--distance: {error}") from error
    record, told = study_record(study), ""
    if arguments.sources:
        study, record["sources"], told = with_sources(study, motions, arguments.sources)
    for rank, placement in enumerate(study.placements, start=1):
        write_placement(folder, f"placement{rank}", study, placement)
    write_placement_picture(folder / "placement.png", study)
    write_text(folder / "study.json", json.dumps(record, indent=2) + "\n")
    print(table(study) + told)
    print(f"{folder}: {len(study.placements)} placements in {study.seconds:.0f} s")
    return SUCCESS


def table(study: PlacementStudy) -> str:
    """The ranking, the curve and what is proven, for people."""
    quantity, head = study.options.quantity, f"expected error [{study.unit}]"
    errors = [p.expected(quantity) for p in study.placements]
    worst = [f"{max(e.values()):.2f} ({max(e, key=e.__getitem__)})" for e in errors]
    last = f"worst joint [{study.unit}]"
    width = max(len(last), *map(len, worst))
    lines = [f"rank  {head}  {last:{width}}  segments"]
    for rank, (p, e, most) in enumerate(zip(study.placements, errors, worst, strict=True), 1):
        mean = sum(e.values()) / len(e)
        lines.append(f"{rank:4d}  {mean:{len(head)}.2f}  {most:{width}}  {', '.join(p.segments)}")
    lines += ["", f"sensors  {head}"]
    lines += [f"{c.sensors:7d}  {c.mean(quantity):{len(head)}.2f}" for c in study.curve]
    return "\n".join([*lines, "", study.certificate.sentence])


def _check_choices(arguments: argparse.Namespace) -> None:
    """Refuse values of options that are not among the valid ones."""
    from mocap_jax.placement.options import OBJECTIVES, OVER, QUANTITIES, ROOTS, SENSOR_KINDS

    arguments.sensors = arguments.sensors.replace(",", "").upper()
    for option, what, valid in (
        ("sensors", "sensor kind", SENSOR_KINDS), ("objective", "objective", OBJECTIVES),
        ("over", "choice", OVER), ("root", "choice", ROOTS), ("quantity", "quantity", QUANTITIES),
    ):  # fmt: skip
        if getattr(arguments, option) not in valid:
            raise unknown_choice(f"--{option}", what, getattr(arguments, option), valid)
    if arguments.hub is not None and arguments.wire is None:
        raise UsageError("--hub: nothing without --wire, the longest total length of wire")
    if arguments.most is not None and arguments.most < arguments.number:
        raise UsageError(f"--most {arguments.most}: must be {arguments.number} (--number) or more")


def _check_segments(options: PlacementOptions, body: Body) -> None:
    """Refuse segments that cannot carry a sensor, by the option that names them."""
    from mocap_jax.placement import carrying_segments

    carrying_segments(body)  # that the body has none is no option's fault
    constraints = options.constraints
    with value_of("--allow"):
        segments = carrying_segments(body, constraints.allowed)
    parents = body.topology.body_parent
    inner = [n for n, parent in zip(body.topology.body_names, parents, strict=True) if parent > 0]
    for name in options.joints:
        if name not in inner:
            raise unknown_choice("--joints", "joint", name, inner)
    for option, names in (("--require", constraints.required), ("--cost", constraints.costs)):
        for name in names:
            if name not in segments:
                raise unknown_choice(option, "segment", name, segments)
    if constraints.wire_m is not None:
        from mocap_jax.simulation.anatomy import anatomy_of

        known = anatomy_of(body).segments
        if constraints.hub not in known:
            raise unknown_choice("--hub", "segment", constraints.hub, known)
    if options.sensors > len(segments):
        raise UsageError(
            f"--number {options.sensors}: more than the {len(segments)} segments that may carry "
            f"a sensor: {', '.join(segments)}"
        )


def _noise(arguments: argparse.Namespace) -> NoiseFigures:
    """White noise of the sensors: what the set-up file names, else the usual figures."""
    from mocap_jax.placement import ErrorModel

    figures = setup_figures(arguments)
    return replace(ErrorModel().noise, **({} if figures is None else figures.noise))


def _options(arguments: argparse.Namespace) -> PlacementOptions:
    from mocap_jax.placement import Constraints, ErrorModel, PlacementOptions, SearchOptions

    return PlacementOptions(
        sensors=arguments.number,
        most=arguments.most,
        objective=arguments.objective,
        over=arguments.over,
        root=arguments.root,
        quantity=arguments.quantity,
        joints=_names(arguments.joints),
        errors=ErrorModel(kinds=arguments.sensors, noise=_noise(arguments)),
        constraints=Constraints(
            allowed=_names(arguments.allow),
            required=_names(arguments.require),
            symmetric=arguments.symmetric,
            costs=_costs(arguments.cost or []),
            budget=arguments.budget,
            hub=arguments.hub or Constraints().hub,
            wire_m=arguments.wire,
            distance_m=arguments.distance,
        ),
        search=SearchOptions(
            restarts=arguments.restarts,
            steps=arguments.steps,
            evaluations=arguments.evaluations,
            seed=arguments.seed,
        ),
    )


def _names(text: str | None) -> tuple[str, ...]:
    return tuple(n.strip() for n in text.split(",") if n.strip()) if text else ()


def _costs(texts: list[str]) -> dict[str, float]:
    costs = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            costs[name] = float(value)
        except ValueError:
            costs[name] = -1.0
        if not 0.0 <= costs[name] < float("inf"):
            raise UsageError(f"--cost {text}: expected SEGMENT=COST, zero or more, as Head=2")
    return costs


def _motion(text: str, arguments: argparse.Namespace) -> Motion:
    """A motion or a stretch of one, on the body of the study."""
    from mocap_jax.motion import BUILTIN_MOTIONS, builtin_motion, human, load_motion, retarget

    name, stretch = named_stretch(text)
    if name in BUILTIN_MOTIONS:
        own = arguments.body is None or is_human(arguments.body)
        body: Body | None = (chosen_body(arguments) or human()) if own else chosen_body(arguments)
        motion = builtin_motion(name, body if own or name == "routine" else None)
    elif not Path(name).exists() and not Path(name).suffix:
        known = ", ".join(BUILTIN_MOTIONS)
        raise InputError(f"{name}: neither a file nor a built-in motion; built in: {known}")
    else:
        motion = load_motion(name)
        body = chosen_body(arguments, motion) or human()
    if body is not None and body.xml != motion.body.xml:
        motion = retarget(motion, body)
    return with_stretch(motion, stretch)

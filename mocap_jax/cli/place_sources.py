"""The option `--sources` of `mocap-jax place`: ultrasonic sources beside the boards chosen."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import TYPE_CHECKING

from mocap_jax.cli.exit_codes import UsageError

if TYPE_CHECKING:
    from mocap_jax.body import Body
    from mocap_jax.motion import Motion
    from mocap_jax.placement import PlacementStudy


# Whatever --quantity, --objective and --over say of the boards.
_CRITERION = "mean squared error of joint centres, mean of motions"


def check_sources(count: int | None, body: Body) -> None:
    """Refuse more sources than there are to choose from."""
    from mocap_jax.simulation import default_suit
    from mocap_jax.simulation.mounting import with_shapes

    if count is None:
        return
    known = [s.name for s in default_suit(with_shapes(body)).sources]
    if count > len(known):
        raise UsageError(
            f"--sources {count}: more than the {len(known)} of the standard suit: "
            f"{', '.join(known)}"
        )


def with_sources(
    study: PlacementStudy, motions: list[Motion], count: int
) -> tuple[PlacementStudy, dict[str, object], str]:
    """The study with sources in its best suit, what `study.json` says of them, and a sentence."""
    from mocap_jax.placement import choose_sources
    from mocap_jax.simulation import Suit, default_suit

    everything = Suit(study.best.suit.boards, default_suit(study.body).sources)
    found = choose_sources(
        motions[0].body, motions, everything, count, study.options, progress=sys.stderr.isatty()
    )
    best = replace(study.best, suit=found.suit)
    record: dict[str, object] = {
        "chosen": list(found.chosen),
        "criterion": _CRITERION,
        "expected_position_error_mean_cm": found.expected_cm,
        "with_all_cm": found.all_cm,
        "without_distances_cm": found.none_cm,
        "certificate": found.certificate.sentence,
    }
    told = (
        f"\n\nsources of placement 1, by the {_CRITERION}: {', '.join(found.chosen)}\n"
        f"expected error {found.expected_cm:.2f} cm with them, {found.all_cm:.2f} with all "
        f"{len(everything.sources)}, {found.none_cm:.2f} without distances"
    )
    return replace(study, placements=(best, *study.placements[1:])), record, told

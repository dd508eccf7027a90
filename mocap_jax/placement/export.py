"""Placements as files: set-up TOML and MJCF, ready for `simulate` and `reconstruct`."""

from __future__ import annotations

from pathlib import Path

from mocap_jax.placement.study import Placement, PlacementStudy
from mocap_jax.simulation import mount, save_suit


def write_placement(folder: Path, stem: str, study: PlacementStudy, placement: Placement) -> None:
    """Write `<stem>.toml`, the suit, and `<stem>.xml`, the body with its sites.

    Each file appears whole or not at all.
    """
    part = folder / f".{stem}.part"
    try:
        save_suit(part, placement.suit)
        part.replace(folder / f"{stem}.toml")
        part.write_text(mount(study.body, placement.suit).xml, encoding="utf-8")
        part.replace(folder / f"{stem}.xml")
    finally:
        part.unlink(missing_ok=True)


def study_record(study: PlacementStudy) -> dict[str, object]:
    """The study as JSON holds it."""
    return {
        "motions": list(study.motions),
        "objective": study.options.objective,
        "quantity": study.options.quantity,
        "root": study.options.root,
        "seconds": study.seconds,
        "certificate": {
            "sentence": study.certificate.sentence,
            "value": study.certificate.value,
            "bound": study.certificate.bound,
            "evaluated": study.certificate.evaluated,
            "exhaustive": study.certificate.exhaustive,
        },
        "placements": [
            {
                "segments": list(p.segments),
                "value": p.value,
                "expected_position_error_cm": {**p.expected_cm, "mean": p.mean_cm},
                "expected_orientation_error_deg": {**p.expected_deg, "mean": p.mean_deg},
                "boards": [
                    {"name": b.name, "segment": b.segment, "position": list(b.position),
                     "orientation": list(b.orientation)}
                    for b in p.suit.boards
                ],
            }
            for p in study.placements
        ],
        "curve": [
            {"sensors": c.sensors, "segments": list(c.segments),
             "expected_position_error_mean_cm": c.mean_cm,
             "expected_orientation_error_mean_deg": c.mean_deg, "exhaustive": c.exhaustive}
            for c in study.curve
        ],
    }  # fmt: skip

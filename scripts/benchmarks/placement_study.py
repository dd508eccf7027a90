"""How long a placement study takes: six sensors, three motions of 5 s."""

from __future__ import annotations

from placement.cells import load
from placement.plan import TRAINING

import mocap_jax as mj
from benchmarks.metric import Metric
from mocap_jax.placement import Constraints, SearchOptions


def placement_study() -> Metric:
    """Seconds of the whole study, compilation included, with pairs of left and right."""
    body = mj.human()
    options = mj.PlacementOptions(
        sensors=6, constraints=Constraints(symmetric=True), search=SearchOptions(evaluations=400)
    )
    study = mj.place(body, [load(c, body) for c in TRAINING], options)
    context = {
        "motions": list(study.motions), "segments": list(study.best.segments),
        "certificate": study.certificate.sentence, "expected_cm": study.best.mean_cm,
    }  # fmt: skip
    return Metric("placement_study_s", study.seconds, "s", "lower", 600.0, context)

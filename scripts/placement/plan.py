"""What is compared: suits, motions and seeds of every part of the reproduction."""

from __future__ import annotations

import json
from argparse import Namespace
from functools import cached_property
from pathlib import Path
from typing import Any

from placement.cells import Cell, Clip, devices, load

TRAINING = (Clip("routine", 4.0, 5.0), Clip("routine", 14.0, 5.0), Clip("walking", 2.0, 5.0))
"""Motions that placements are chosen for."""
CLIPS = (
    "01_06.amc", "02_05.amc", "02_07.amc", "02_10.amc", "03_04.amc", "13_29.bvh",
    "60_13_salsa_60Hz.bvh",
)  # fmt: skip
"""CMU clips that are long enough."""
OTHERS = tuple(Clip(name, 2.0, 5.0) for name in CLIPS)
"""Motions of other people, which no study knows either."""
SIP6 = ("pelvis", "head", "left_forearm", "right_forearm", "left_shank", "right_shank")
"""Boards of the standard suit at the Sparse Inertial Poser's places (von Marcard 2017)."""
ENDS = ("pelvis", "head", "left_hand", "right_hand", "left_foot", "right_foot")
"""Hands and feet in place of forearms and shanks."""
SOURCES = 4


class Plan:
    """All suits by name, and the cells of all parts."""

    def __init__(self, arguments: Namespace, folder: Path) -> None:
        self.arguments, self.folder = arguments, folder
        motion, _, stretch = arguments.test.rpartition(":")
        start, end = (float(x) for x in stretch.split("-"))
        self.test = Clip(motion, start, end - start)
        """The motion that placements are scored on."""

    @property
    def key(self) -> str:
        """What studies depend on, for names of files."""
        a = self.arguments
        return "-".join([a.root, str(a.evaluations), *a.require])

    @cached_property
    def body(self) -> Any:
        """Who wears them."""
        import mocap_jax as mj

        return mj.human()

    @cached_property
    def standard(self) -> Any:
        """The suit of 18 boards and 8 sources."""
        from mocap_jax.simulation import default_suit

        return default_suit(self.body)

    def boards(self, names: tuple[str, ...]) -> tuple:
        """Boards of the standard suit."""
        return tuple(b for b in self.standard.boards if b.name in names)

    def cells(self) -> list[Cell]:
        """Cells of all parts asked for, each once."""
        parts, seeds = self.arguments.parts, range(self.arguments.seeds)
        out: dict[Cell, None] = {}
        if "six" in parts:
            out |= dict.fromkeys(self.cell(s, k) for s in ("sip6", "chosen") for k in seeds)
        few = range(min(self.arguments.seeds, 5))
        if "clips" in parts:
            pairs = [(s, c) for c in OTHERS for s in ("sip6", "chosen")]
            out |= dict.fromkeys(self.cell(s, k, c) for s, c in pairs for k in few)
        if "hands" in parts:
            out |= dict.fromkeys(self.cell(s, k) for s in ("sip6", "ends") for k in few)
        if "random" in parts:
            out |= dict.fromkeys(self.cell(n, 0) for n in ("chosen", *self.random_names()))
        if "correlation" in parts:
            names = self.random_names()[: self.arguments.correlated]
            out |= dict.fromkeys(self.cell(n, 0) for n in names)
        if "sources" in parts:
            out |= dict.fromkeys(
                self.cell(s, k) for s in ("eight_sources", "four_sources") for k in few
            )
        return list(out)

    def random_names(self) -> tuple[str, ...]:
        """Names of the random placements."""
        return tuple(f"random{i}" for i in range(self.arguments.random))

    def cell(self, suit: str, seed: int, clip: Clip | None = None) -> Cell:
        """One reconstruction; of the test motion, if no other is named."""
        boards, sources = self.suit(suit)
        a = self.arguments
        sites = devices(boards), devices(sources)
        return Cell(clip or self.test, *sites, "field", seed, a.root, a.rate)

    def suit(self, name: str) -> tuple[tuple, tuple]:
        """Boards and sources by name."""
        if name == "sip6":
            return self.boards(SIP6), ()
        if name == "ends":
            return self.boards(ENDS), ()
        if name == "chosen":
            return self.chosen, ()
        if name == "eight_sources":
            return self.standard.boards, self.standard.sources
        if name == "four_sources":
            return self.standard.boards, tuple(
                s for s in self.standard.sources if s.name in self.sources["chosen"]
            )
        return self.random_boards(int(name.removeprefix("random"))), ()

    def random_boards(self, number: int) -> tuple:
        """Six segments and places on them at random."""
        import jax.numpy as jnp
        import numpy as np

        from mocap_jax.placement.mounting import mounting_at
        from mocap_jax.placement.surface import Surfaces, patches_of

        rng = np.random.default_rng((2017, number))
        patches = patches_of(self.body)
        chosen = sorted(rng.choice(len(patches), 6, replace=False))
        surfaces = Surfaces(tuple(patches[i] for i in chosen))
        places = np.asarray(surfaces.places(jnp.asarray(rng.normal(size=(6, 2)))))
        return tuple(mounting_at(p, x) for p, x in zip(surfaces.patches, places, strict=True))

    def options(self) -> Any:
        """Of the study."""
        from mocap_jax.placement import Constraints, PlacementOptions, SearchOptions

        return PlacementOptions(
            sensors=6, most=6, root=self.arguments.root,
            constraints=Constraints(symmetric=True, required=tuple(self.arguments.require)),
            search=SearchOptions(evaluations=self.arguments.evaluations),
        )  # fmt: skip

    @cached_property
    def chosen(self) -> tuple:
        """Boards of the study's best placement; kept as a file."""
        from mocap_jax.placement import place, study_record
        from mocap_jax.simulation import Mounting

        file = self.folder / f"study-{self.key}.json"
        if not file.is_file():
            motions = [load(c, self.body) for c in TRAINING]
            study = place(self.body, motions, self.options(), progress=True)
            keep(file, study_record(study))
        record = json.loads(file.read_text(encoding="utf-8"))
        return tuple(
            Mounting(b["name"], b["segment"], tuple(b["position"]), tuple(b["orientation"]))
            for b in record["placements"][0]["boards"]
        )

    @cached_property
    def sources(self) -> dict[str, Any]:
        """The study of sources; kept as a file."""
        from mocap_jax.placement import choose_sources

        file = self.folder / f"sources-{self.key}.json"
        if not file.is_file():
            motions = [load(c, self.body) for c in TRAINING]
            found = choose_sources(
                self.body, motions, self.standard, SOURCES, self.options(), progress=True
            )
            keep(file, {
                "chosen": list(found.chosen), "expected_cm": found.expected_cm,
                "all_cm": found.all_cm, "none_cm": found.none_cm, "loss": found.loss,
                "sentence": found.certificate.sentence,
            })  # fmt: skip
        return json.loads(file.read_text(encoding="utf-8"))

    def expected(self, names: tuple[str, ...]) -> dict[str, float]:
        """Expected mean errors [cm] in the test motion by the study's model (`Criterion.risk`)."""
        import numpy as np

        from mocap_jax.placement import Judge
        from mocap_jax.simulation import Suit

        file = self.folder / f"expected-{self.key}-{self.test.label}.json"
        known = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
        if missing := [n for n in names if n not in known]:
            judge = Judge(self.body, [load(self.test, self.body)], self.options())
            for n in missing:
                risk = judge.criterion.risk(judge.evaluate(Suit(self.suit(n)[0])))
                known[n] = float(100 * np.sqrt(risk).mean())
            keep(file, known)
        return {n: known[n] for n in names}


def keep(file: Path, record: object) -> None:
    """Write a JSON file whole or not at all."""
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(".part")
    part.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    part.replace(file)

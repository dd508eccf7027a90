"""Masses and moments of inertia: de Leva's parts come back from the segments they were cut into."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from mocap_jax.motion import human
from mocap_jax.motion.human import Sex
from mocap_jax.motion.human.inertia import Lump, combined, segment_lumps
from mocap_jax.motion.human.proportions import SIDED, proportions

TRUNK = ("Pelvis", "L5", "L3", "T12", "T8")
SEXES = ("female", "male", None)


def whole(sex: Sex | None, *parts: str) -> Lump:
    """Several segments as one, paired ones on both sides, from the middle of the hips."""
    body, lumps = proportions(sex), segment_lumps(sex)
    placed = []
    for part in parts:
        lump = lumps[part].moved(body.place(part))
        placed.append(lump)
        if part in SIDED:
            placed.append(Lump(lump.mass, lump.centre * [1, -1, 1], lump.spread))
    return combined(placed)


@pytest.mark.parametrize("sex", SEXES)
def test_segments_make_one_body(sex: Sex | None) -> None:
    lumps = segment_lumps(sex)
    assert len(lumps) == 15
    assert whole(sex, *lumps).mass == pytest.approx(1.0, abs=1e-14)
    for part, lump in lumps.items():
        assert lump.mass > 0 and (lump.spread > 0).all(), part


# Share of body mass and centre from C7 over the distance from C7 to the hips: the table's row for
# the whole trunk, which was not used. Its male parts together have theirs at 0.5187, not 0.5138.
@pytest.mark.parametrize(("sex", "mass", "centre"), [
    ("female", 0.4257, 0.4964), ("male", 0.4346, 0.5138),
])  # fmt: skip
def test_trunk_is_that_of_the_table(sex: Sex, mass: float, centre: float) -> None:
    trunk = whole(sex, *TRUNK, "Shoulder")
    top = proportions(sex).place("Neck")[2]
    assert trunk.mass == pytest.approx(mass, abs=2e-4)
    assert 1 - trunk.centre[2] / top == pytest.approx(centre, abs=6e-3)
    assert trunk.centre[1] == pytest.approx(0.0, abs=1e-12)


# Radii of gyration of the whole trunk about the fore-aft, left-right and long axis, as above.
@pytest.mark.parametrize(("sex", "radii"), [
    ("female", (0.307, 0.292, 0.147)), ("male", (0.328, 0.306, 0.169)),
])  # fmt: skip
def test_trunk_has_about_the_table_s_radii_of_gyration(
    sex: Sex, radii: tuple[float, float, float]
) -> None:
    trunk = whole(sex, *TRUNK, "Shoulder")
    top = proportions(sex).place("Neck")[2]
    moments = trunk.spread.sum() - trunk.spread
    np.testing.assert_allclose(np.sqrt(moments) / top, radii, rtol=0.12)


# Centre of mass from the vertex, sagittal radius of gyration [stature]: table, vertex to C7.
@pytest.mark.parametrize(("sex", "centre", "radius"), [
    ("female", 0.4841, 0.271 * 243.7 / 1735), ("male", 0.5002, 0.303 * 242.9 / 1741),
])  # fmt: skip
def test_head_and_neck_are_those_of_the_table(sex: Sex, centre: float, radius: float) -> None:
    head, body = whole(sex, "Neck", "Head"), proportions(sex)
    length = body.end["Neck"][2] + body.end["Head"][2]
    assert 1 - (head.centre[2] - body.place("Neck")[2]) / length == pytest.approx(centre)
    assert np.sqrt(head.spread[1] + head.spread[2]) == pytest.approx(radius)


def test_a_woman_s_centre_of_mass_is_lower() -> None:
    height = {}
    for sex in ("female", "male"):
        model = human(sex=sex).mujoco_model()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        height[sex] = data.subtree_com[1, 2] / 1.75
    assert 0.53 < height["female"] < height["male"] < 0.59


def test_moments_grow_with_mass_and_the_square_of_stature() -> None:
    small, large = (human(h, m).mujoco_model() for h, m in ((1.5, 50.0), (1.8, 100.0)))
    factor = 2 * (1.8 / 1.5) ** 2
    np.testing.assert_allclose(large.body_inertia, factor * small.body_inertia, rtol=1e-9)
    # A thigh about its sideways axis: 14.47 % of the mass, radius 34.65 % of length (both means).
    thigh = small.body("LeftUpperLeg")
    inertia = 50.0 * 0.1447 * (0.3465 * 0.245 * 1.5) ** 2
    assert np.sort(thigh.inertia)[1] == pytest.approx(inertia, rel=0.01)

"""Accelerations turned into the world by measured orientations (von Marcard 2017, eq. 13 to 16)."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest
from synthetic import record, small_body
from test_sequence_assembly import BODY, make

import mocap_jax as mj
from mocap_jax.errors import InputError
from mocap_jax.estimate.sequence.terms import build
from mocap_jax.measurement import gather

OPTIONS = mj.OptimiseOptions(
    kinds="AO", root="free", stencil="plain", acceleration_rotation="measured"
)


def test_residual_is_that_of_the_paper() -> None:
    """a^G = R_measured a^S + gravity against second differences of positions from C MuJoCo."""
    problem, state = make(2, measured=True)
    # Lengths of the random problem are changed; here they are as in the model.
    geometry = dataclasses.replace(state.constants.geometry, length=np.zeros(2))
    constants = dataclasses.replace(state.constants, geometry=geometry)
    state = dataclasses.replace(state, constants=constants)
    model = mujoco.MjModel.from_xml_string(BODY)
    data, places = mujoco.MjData(model), []
    for q in state.q:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        turned = data.site_xmat[:4].reshape(4, 3, 3)
        places.append(data.site_xpos[:4] + np.einsum("sij,sj->si", turned, constants.offset))
    places = np.array(places)
    terms, step = problem.terms, problem.step
    felt = np.asarray(terms.force) - constants.accelerometer_bias
    world = np.einsum("tsij,tsj->tsi", np.asarray(terms.orientation), felt) + model.opt.gravity
    c = np.array(problem.layout.force_weights)
    measured = c[0] * world[:-2] + c[1] * world[1:-1] + c[2] * world[2:]
    expected = (places[:-2] - 2 * places[1:-1] + places[2:]) / step**2 - measured
    found = np.asarray(problem.residuals(state)["accelerometer"])[1:-1]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    model_s, _ = make(2)
    assert np.abs(model_s.residuals(state)["accelerometer"][1:-1] - expected).max() > 1.0


def built(lost: slice, kinds: str = "AO", **changes: object):
    """The problem of a still recording whose orientations are lost for a while."""
    recording = record(seconds=2.0, root=False)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(recording.inertial["pelvis"].time), 1))
    still[lost] = np.nan
    inertial = {k: dataclasses.replace(v, orientation=still) for k, v in recording.inertial.items()}
    recording = dataclasses.replace(recording, inertial=inertial)
    options = dataclasses.replace(OPTIONS, kinds=kinds, **changes)
    data = gather(recording, small_body(), kinds=kinds, root=False)
    model = dataclasses.replace(options, acceleration_rotation="model")
    made = (build(data, small_body(), recording.setup, o, root_given=False)
            for o in (model, options))  # fmt: skip
    return tuple(made)


@pytest.mark.parametrize(("stencil", "wider"), [("plain", 0), ("consistent", 1)])
def test_accelerations_without_a_measured_orientation_are_left_out(
    stencil: str, wider: int
) -> None:
    plain, measured = built(slice(100, 110), stencil=stencil)
    before, after = (np.isfinite(b.variances["accelerometer"][0]) for b in (plain, measured))
    gone = np.flatnonzero((before & ~after).any(1))
    np.testing.assert_array_equal(gone, np.arange(100 - wider, 110 + wider))
    assert measured.layout.measured_rotation and not plain.layout.measured_rotation


def test_wrong_input() -> None:
    with pytest.raises(InputError, match="no orientations are used .kinds 'AG'"):
        built(slice(0, 0), kinds="AG")
    with pytest.raises(InputError, match="heading_sigma makes measured orientations unknown"):
        built(slice(0, 0), constants=mj.ConstantsOptions(heading_sigma=0.2))
    with pytest.raises(InputError, match="acceleration_rotation 'paper'.*model.*measured"):
        built(slice(0, 0), acceleration_rotation="paper")


def test_the_default_is_the_rotation_that_is_solved_for() -> None:
    assert mj.OptimiseOptions().acceleration_rotation == "model"
    assert mj.sparse_options().acceleration_rotation == "model"
    assert mj.table1_options(60.0).acceleration_rotation == "measured"

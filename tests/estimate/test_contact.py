"""Which feet stand, where their soles are, and what that makes of the weights."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

import mocap_jax as mj
from mocap_jax.body import Body, load_body
from mocap_jax.errors import InputError
from mocap_jax.estimate.contact.contacts import Contacts
from mocap_jax.estimate.contact.detect import standing_boards, standing_points
from mocap_jax.estimate.contact.feet import feet_of, positions
from mocap_jax.residuals.contact import depth

RATE = 60.0
OPTIONS = mj.ContactOptions()
LEG = """<body name="{side}LowerLeg" pos="0 {y} -.4"><joint name="{side}Hip" type="ball"/>
<geom size=".05"/><body name="{side}Foot" pos="0 0 -.5"><joint name="{side}Ankle" type="ball"/>
<geom size=".05"/><site name="{side}_board" pos=".05 0 0" quat=".6 .2 .7 .3"/>
<body name="{side}Toe" pos=".12 0 -.08"><joint axis="0 1 0"/><geom size=".02"/></body>
</body></body>"""


def biped() -> Body:
    legs = "".join(LEG.format(side=s, y=y) for s, y in (("Left", 0.1), ("Right", -0.1)))
    return load_body(
        '<mujoco><worldbody><body name="Pelvis" pos="0 0 1"><freejoint/><geom size=".1"/>'
        f"{legs}</body></worldbody></mujoco>"
    )


def strides(speed: float = 1.3, cycle: float = 1.1, seconds: float = 8.0) -> np.ndarray:
    """Paths (t, 2, 3) of two feet that stand for 60 % of each stride and swing in between."""
    t = np.arange(round(seconds * RATE)) / RATE
    out = np.zeros((len(t), 2, 3))
    for foot, phase in enumerate((0.0, 0.5)):
        whole, part = np.divmod(t / cycle + phase, 1.0)
        swing = np.clip((part - 0.6) / 0.4, 0.0, 1.0)
        out[:, foot, 0] = speed * cycle * (whole + swing**3 * (10 - 15 * swing + 6 * swing**2))
        out[:, foot, 2] = 0.1 * np.sin(np.pi * swing) ** 2
    return out


def truly_standing(path: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.gradient(path, 1 / RATE, axis=0), axis=-1) < OPTIONS.fastest


def agreement(found: np.ndarray, true: np.ndarray) -> tuple[float, float]:
    """Precision and recall."""
    both = (found & true).sum()
    return both / max(found.sum(), 1), both / true.sum()


def drifting(path: np.ndarray) -> np.ndarray:
    """As an estimate with a wandering root shows it: up to 1 m/s off after some seconds."""
    t = np.arange(len(path)) / RATE
    off = np.stack([0.06 * t**2, -0.3 * t, 0.05 * np.sin(t)], axis=1)
    return path + off[:, None]


def test_standing_feet_are_found_in_a_walk() -> None:
    path = strides()
    found = standing_points(path, 1 / RATE, OPTIONS, drifts=False)
    precision, recall = agreement(found, truly_standing(path))
    assert precision > 0.97 and recall > 0.8


def test_drift_of_the_root_does_not_hide_them() -> None:
    path = strides()
    true = truly_standing(path)
    found = standing_points(drifting(path), 1 / RATE, OPTIONS, drifts=True)
    precision, recall = agreement(found, true)
    assert precision > 0.95 and recall > 0.85
    naive = standing_points(drifting(path), 1 / RATE, OPTIONS, drifts=False)
    assert agreement(naive, true)[1] < 0.6


def test_feet_in_flight_do_not_stand() -> None:
    """A jump of 0.5 s between two stands, both feet as one."""
    t = np.arange(240) / RATE
    air = np.clip(t - 1.75, 0.0, 0.5)
    path = np.zeros((240, 2, 3))
    path[..., 2] = (0.5 * 9.81 * air * (0.5 - air))[:, None]
    found = standing_points(path, 1 / RATE, OPTIONS, drifts=True)
    flying = (t > 1.8) & (t < 2.2)
    assert not found[flying].any()
    assert found[(t < 1.6) | (t > 2.4)].all()


def test_boards_on_feet_tell_by_themselves() -> None:
    body = biped()
    feet = feet_of(body, np.asarray(body.qpos0))
    rng, n = np.random.default_rng(0), 300
    moving = np.zeros(n, bool)
    moving[100:150] = True
    up = np.array([0.3, -0.4, 0.8]) * 9.81 / np.linalg.norm([0.3, -0.4, 0.8])
    force = np.tile(up, (n, 2, 1)) + 0.1 * rng.normal(size=(n, 2, 3))
    rate = 0.02 * rng.normal(size=(n, 2, 3))
    force[moving, 0] += 8.0 * rng.normal(size=(50, 3))
    rate[moving, 0] += 3.0
    force[200:210] = np.nan
    sites = tuple(body.site_index(f"{side}_board") for side in ("Right", "Left"))
    data = SimpleNamespace(
        time=np.arange(n) / RATE, step=1 / RATE, sites=sites, accelerometer=force, gyroscope=rate
    )
    found = standing_boards(data, body, feet, OPTIONS)  # type: ignore[arg-type]
    left = np.array([body.topology.body_names[b] == "LeftFoot" for b in feet.bodies])
    assert not found[102:148, ~left].any() and found[:97, ~left].all()
    assert found[:195, left].all() and not found[202:208].any()


def test_soles_are_level_and_turn_with_the_foot() -> None:
    body = biped()
    feet = feet_of(body, np.asarray(body.qpos0))
    assert len(feet.bodies) == 4
    world = positions(body, feet, np.asarray(body.qpos0)[None])[0]
    np.testing.assert_allclose(world[:, 2], 1 - 0.4 - 0.5 - 0.08, atol=1e-12)
    ankle = np.array([0.0, 0.1, 0.1])
    np.testing.assert_allclose(world[0, :2] - ankle[:2], [-0.3 * 0.12, 0.0], atol=1e-12)
    np.testing.assert_allclose(world[1, :2] - ankle[:2], [0.12, 0.0], atol=1e-12)


def test_a_body_without_feet_is_refused() -> None:
    body = load_body("<mujoco><worldbody><body name='Pelvis'><freejoint/><geom size='.1'/></body>"
                     "</worldbody></mujoco>")  # fmt: skip
    with pytest.raises(InputError, match="the body has no feet; it needs segments named LeftFoot"):
        feet_of(body, np.asarray(body.qpos0))


@pytest.mark.parametrize("name", ["slip", "ground_sigma", "window"])
def test_options_are_checked(name: str) -> None:
    with pytest.raises(InputError, match=f"contacts: {name} 0: must be above 0"):
        dataclasses.replace(OPTIONS, **{name: 0.0})
    with pytest.raises(InputError, match="contacts: loss 'l1'; valid: none, huber"):
        dataclasses.replace(OPTIONS, loss="l1")


def _contacts(body: Body, frames: int, options: mj.ContactOptions, rest: np.ndarray) -> Contacts:
    data = SimpleNamespace(time=np.arange(frames) / RATE, step=1 / RATE, sites=())
    return Contacts(data, body, np.asarray(body.qpos0), options, rest, root_given=False)  # type: ignore[arg-type]


def test_weights_of_a_stand() -> None:
    """A still body, seen after a first solve: all points stand, on the ground that they show."""
    body, n = biped(), 60
    q = np.tile(np.asarray(body.qpos0), (n, 1))
    contacts = _contacts(body, n, OPTIONS, np.arange(10))
    (stays, stands, above), ground = contacts.update(q, 0, last=False)
    assert not stays.any() and not stands.any() and (above > 0).all()
    (stays, stands, above), ground = contacts.update(q, 1, last=True)
    np.testing.assert_allclose(stays[:-1], RATE / OPTIONS.slip**2)
    assert not stays[-1].any() and not above.any() and (stands > 0).all()
    assert ground.height == pytest.approx(0.02) and ground.mu == OPTIONS.mu[-1]
    # As much as one observation in half a second.
    assert stands[:30].sum(0) == pytest.approx(np.full(4, 1 / OPTIONS.ground_sigma**2))


def test_ground_may_be_given_or_left_out() -> None:
    body, n = biped(), 30
    q = np.tile(np.asarray(body.qpos0), (n, 1))
    given = _contacts(body, n, mj.ContactOptions(ground=0.5), np.arange(3))
    assert given.update(q, 1, last=False)[1].height == 0.5
    uneven = _contacts(body, n, mj.ContactOptions(level=False), np.arange(3))
    stays, stands, above = uneven.update(q, 1, last=False)[0]
    assert stays.any() and not stands.any() and not above.any()


def test_depth_is_that_below_the_ground() -> None:
    np.testing.assert_allclose(
        depth(jnp.array([-0.2, 0.0, 0.2]), 0.01), [0.2, 0.01 * np.log(2), 0.0], atol=1e-8
    )


def test_switches() -> None:
    assert mj.OptimiseOptions().contacts is None and mj.sparse_options().contacts is None
    assert mj.sparse_options(contacts=True).contacts == OPTIONS

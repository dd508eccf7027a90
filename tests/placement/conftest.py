"""A small person (trunk, head, one arm) in smooth motion, and a study of it that is quick."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from mocap_jax.body import Body, load_body, retract
from mocap_jax.motion import Motion
from mocap_jax.placement import PlacementOptions, SearchOptions
from mocap_jax.trajectory import Trajectory

XML = """<mujoco><worldbody><body name="Pelvis" pos="0 0 1"><freejoint name="root"/>
<geom type="capsule" fromto="0 -.08 0 0 .08 0" size=".09"/>
<body name="T8" pos="0 0 .25"><joint name="spine" type="ball"/>
<geom type="capsule" fromto="0 -.08 .1 0 .08 .1" size=".1"/>
<body name="Head" pos="0 0 .3"><joint name="nod" axis="0 1 0" range="-40 40" limited="true"/>
<geom type="capsule" fromto="0 0 .08 .01 0 .12" size=".08"/></body>
<body name="RightUpperArm" pos="0 -.2 .15"><joint name="shoulder" type="ball"/>
<geom type="capsule" fromto="0 0 -.03 0 0 -.25" size=".04"/>
<body name="RightForeArm" pos="0 0 -.28"><joint name="elbow" axis="0 -1 0"/>
<joint name="twist" axis="0 0 1"/>
<geom type="capsule" fromto="0 0 -.03 0 0 -.22" size=".03"/>
<body name="RightHand" pos="0 0 -.25"><joint name="wrist" axis="1 0 0"/>
<geom type="capsule" fromto="0 0 -.02 0 0 -.14" size=".02"/></body></body></body>
</body></body></worldbody></mujoco>"""


@pytest.fixture(scope="session")
def person() -> Body:
    return load_body(XML)


@pytest.fixture(scope="session")
def motions(person: Body) -> tuple[Motion, ...]:
    return tuple(_motion(person, seed) for seed in (0, 1))


def _motion(person: Body, seed: int) -> Motion:
    rng = np.random.default_rng(seed)
    time = np.arange(0, 1.5 + 0.2 * seed, 1 / 60)
    size = np.where(np.arange(person.nv) < 6, 0.1, rng.uniform(0.2, 0.5, person.nv))
    frequency = rng.uniform(0.4, 1.2, person.nv)
    delta = size * np.sin(2 * np.pi * frequency * time[:, None] + rng.uniform(0, 6, person.nv))
    q = np.array([retract(person.topology, person.qpos0, jnp.asarray(d)) for d in delta])
    return Motion(f"sines {seed}", person, Trajectory(jnp.asarray(time), jnp.asarray(q)), {})


@pytest.fixture(scope="session")
def quick() -> PlacementOptions:
    search = SearchOptions(restarts=2, steps=6, evaluations=30, ranked=2)
    return PlacementOptions(sensors=2, most=3, rate_hz=15.0, search=search)

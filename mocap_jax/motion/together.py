"""Several people in one world: their bodies and motions as one, their names prefixed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from xml.etree import ElementTree

import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from mocap_jax.body import Body, load_body
from mocap_jax.body.mjcf_text import numbers
from mocap_jax.body.site_names import PREFIXES
from mocap_jax.errors import InputError, unknown_name
from mocap_jax.motion.motion import Motion
from mocap_jax.motion.skeleton import TIP_PREFIX
from mocap_jax.trajectory import Trajectory

_TAKEN = ("compiler", "default", "custom", "worldbody", "option", "size", "statistic", "visual")
# Elements whose settings hold for the whole model: they must be the same.
_COMMON = ("compiler", "default", "option")


Place = tuple[float, float, float]


def together(motions: Mapping[str, Motion], places: Mapping[str, Place] | None = None) -> Motion:
    """One motion of several people.

    Bodies, joints, sites, shapes and custom numbers get their owner's name in front (`a/Pelvis`;
    `anchor/a/door`, `source/a/hat` and `tip/a/Head`, whose first words stay first). Everybody
    stands, at the reference pose, upright where the own clip starts. Clips are cut to the shortest.

    Args:
        motions: by the names of the people, with the same frame rate; bodies without meshes,
            sensors and actuators.
        places: how far the clip of some of them is moved, x and y [m], after a turn about the
            world's z axis [rad]. Anchors that their bodies carry stand in the room, and stay.

    Raises:
        InputError: fewer than two people, a name that cannot be a prefix, a place for nobody, a
            clip of one frame, different rates or model-wide settings, or a body that is more than
            segments, joints, shapes, sites and custom numbers.
    """
    places = places or {}
    for name in places:
        if name not in motions:
            raise unknown_name("person", name, motions)
    if len(motions) < 2:
        raise InputError(f"together: {len(motions)} motions; at least two people are needed")
    for name in motions:
        if not name or "/" in name:
            raise InputError(f"together: '{name}' cannot be a prefix: a name without '/' is needed")
    motions = {name: _moved(m, places.get(name, (0.0, 0.0, 0.0))) for name, m in motions.items()}
    times = {name: np.asarray(m.trajectory.time) for name, m in motions.items()}
    for name, t in times.items():
        if len(t) < 2:
            raise InputError(
                f"together: the motion of '{name}' has {len(t)} frame{'s' * (len(t) != 1)}; at "
                "least two are needed"
            )
    steps = {name: float(t[-1] - t[0]) / (len(t) - 1) for name, t in times.items()}
    if max(steps.values()) > 1.0001 * min(steps.values()):
        rates = ", ".join(f"{name} {1 / step:.6g} Hz" for name, step in steps.items())
        raise InputError(f"together: frame rates differ: {rates}; bring them to one first")
    count = min(len(t) for t in times.values())
    poses = [np.asarray(m.trajectory.q)[:count] for m in motions.values()]
    q = jnp.asarray(np.concatenate(poses, axis=1))
    body = load_body(_document({name: _standing(m) for name, m in motions.items()}))
    time = jnp.asarray(min(steps.values()) * np.arange(count))
    title = " and ".join(f"{name}: {m.name}" for name, m in motions.items())
    return Motion(title, body, Trajectory(time, q), {"people": ", ".join(motions)})


def _moved(motion: Motion, place: Place) -> Motion:
    """The clip turned about the world's z axis, then shifted."""
    if not motion.body.has_free_root:
        raise InputError(f"motion '{motion.name}': its body has no free root joint")
    q, turn = np.array(motion.trajectory.q), Rotation.from_euler("z", place[2])
    q[:, :3] = turn.apply(q[:, :3]) + [*place[:2], 0.0]
    turned = turn * Rotation.from_quat(q[:, 3:7], scalar_first=True)
    q[:, 3:7] = turned.as_quat(scalar_first=True)
    return replace(motion, trajectory=Trajectory(motion.trajectory.time, jnp.asarray(q)))


def _standing(motion: Motion) -> ElementTree.Element:
    """The body's document with its root upright where the clip starts, heading as there."""
    body: Body = motion.body
    first, own = np.asarray(motion.trajectory.q)[0], np.asarray(body.qpos0)
    reference = Rotation.from_quat(own[3:7], scalar_first=True)
    turn = (Rotation.from_quat(first[3:7], scalar_first=True) * reference.inv()).as_matrix()
    heading = Rotation.from_euler("z", np.arctan2(turn[1, 0], turn[0, 0]))
    tree = ElementTree.fromstring(body.xml)
    root = tree.find("worldbody/body")
    assert root is not None  # it has a free root
    for other in ("axisangle", "euler", "xyaxes", "zaxis"):
        root.attrib.pop(other, None)
    root.set("pos", numbers([first[0], first[1], own[2]]))
    root.set("quat", numbers((heading * reference).as_quat(scalar_first=True)))
    return tree


def _document(trees: dict[str, ElementTree.Element]) -> str:
    """One MJCF text of all, names prefixed."""
    out = ElementTree.Element("mujoco", model="people")
    world = ElementTree.Element("worldbody")
    custom = ElementTree.Element("custom")
    common: dict[str, bytes] = {}
    for person, tree in trees.items():
        for part in tree:
            if part.tag not in _TAKEN:
                raise InputError(
                    f"together: the body of '{person}' has <{part.tag}>; only segments, joints, "
                    "shapes and sites can be put together"
                )
            if part.tag in _COMMON:
                text = ElementTree.tostring(part).strip()
                if common.setdefault(part.tag, text) != text:
                    raise InputError(f"together: <{part.tag}> of '{person}' differs from the rest")
        for element in tree.findall("worldbody//*[@name]"):
            kinds = PREFIXES if element.tag == "site" else ()
            element.set("name", _owned(person, element.get("name", ""), kinds))
        custom.extend(_custom(person, tree))
        own = tree.find("worldbody")
        assert own is not None  # every body has one
        world.extend(own)
    out.extend(ElementTree.fromstring(text) for text in common.values())
    if len(custom):
        out.append(custom)
    out.append(world)
    return ElementTree.tostring(out, encoding="unicode")


def _custom(person: str, tree: ElementTree.Element) -> list[ElementTree.Element]:
    """Custom elements of a person, their names prefixed."""
    found = tree.findall("custom/*")
    for element in found:
        if element.tag != "numeric":
            raise InputError(
                f"together: the body of '{person}' has <custom> <{element.tag}>; only <numeric> "
                "can be put together"
            )
        element.set("name", _owned(person, element.get("name", ""), (TIP_PREFIX,)))
    return found


def _owned(person: str, name: str, kinds: tuple[str, ...]) -> str:
    """The name with its owner in front, after the word for its kind where it begins with one."""
    kind = next((k for k in kinds if name.startswith(k)), "")
    return f"{kind}{person}/{name.removeprefix(kind)}"

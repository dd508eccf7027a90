"""`Body`: an articulated body as a JAX pytree, compiled from MJCF by MuJoCo."""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from xml.etree import ElementTree

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jax import Array
from jaxtyping import Float

from mocap_jax.body.topology import Topology
from mocap_jax.errors import InputError

_JOINT_TYPE = {
    mujoco.mjtJoint.mjJNT_FREE: "free",
    mujoco.mjtJoint.mjJNT_BALL: "ball",
    mujoco.mjtJoint.mjJNT_SLIDE: "slide",
    mujoco.mjtJoint.mjJNT_HINGE: "hinge",
}


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Body:
    """An articulated body: kinematic tree, named sites, joint ranges.

    Arrays are differentiable leaves; `topology` and `xml` are static. Frames: each body frame is
    given in its parent's frame, each site frame in its body's frame. Metres, radians, wxyz.
    """

    body_pos: Float[Array, "nbody 3"]
    body_quat: Float[Array, "nbody 4"]
    joint_pos: Float[Array, "njoint 3"]
    joint_axis: Float[Array, "njoint 3"]
    joint_range: Float[Array, "njoint 2"]
    """Lower and upper limit [rad or m]; -inf, inf where unlimited; (0, largest angle) for balls."""
    qpos0: Float[Array, "nq"]
    site_pos: Float[Array, "nsite 3"]
    site_quat: Float[Array, "nsite 4"]
    gravity: Float[Array, "3"]
    topology: Topology = dataclasses.field(metadata={"static": True})
    xml: str = dataclasses.field(metadata={"static": True})
    """MJCF text; empty where the arrays are traced ones that no text can follow."""

    @property
    def nq(self) -> int:
        """Length of the pose vector q (quaternions count four)."""
        return self.topology.nq

    @property
    def nv(self) -> int:
        """Degrees of freedom: length of velocities and of tangent vectors."""
        return self.topology.nv

    @property
    def has_free_root(self) -> bool:
        """Whether the first joint is a free joint."""
        return bool(self.topology.joint_types) and self.topology.joint_types[0] == "free"

    def site_index(self, name: str) -> int:
        """Index of a site; raises `InputError` with the valid names."""
        return self.topology.site_index(name)

    def mujoco_model(self) -> mujoco.MjModel:
        """The C MuJoCo model this body was compiled from (cached; do not modify).

        Raises:
            InputError: the body has no MJCF, because it was made under a JAX transformation.
        """
        if not self.xml:
            raise InputError(
                "this body has no MJCF (it was made from traced numbers, within jit, grad or "
                "vmap); make it from plain numbers to use MuJoCo or to write it to a file"
            )
        return _compile_text(self.xml)

    def replace(self, **changes: Array) -> Body:
        """Copy with some arrays replaced."""
        return dataclasses.replace(self, **changes)


@lru_cache(maxsize=16)
def _compile_text(xml: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(xml)


def load_body(source: str | os.PathLike[str], *, free_root: bool | None = None) -> Body:
    """Load a body from an MJCF file, MJCF text or an OpenSim model.

    Args:
        source: path of an MJCF file, or the XML text itself (anything starting with `<`); or an
            OpenSim model, by its suffix `.osim` or its text (see docs/opensim.md).
        free_root: True puts a free joint on the first body if it has none; False and None
            leave the model as it is.

    Raises:
        InputError: the file is missing, MuJoCo cannot compile it, it has no joints, or it uses a
            feature that the kinematics does not represent (named in the text).
    """
    text, name, folder = _read_source(source)
    if name.lower().endswith(".osim") or "<OpenSimDocument" in text[:1000]:
        from mocap_jax.body.opensim import opensim_mjcf  # it needs `Body` itself

        text, folder = opensim_mjcf(text, name), ""
    if free_root:
        text = _with_free_root(text, name)
    try:
        if folder:
            spec = mujoco.MjSpec.from_string(text)
            spec.modelfiledir = folder
            model = spec.compile()
        else:
            model = _compile_text(text)
    except (ValueError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{name}: not a valid MJCF model: {reason}") from error
    _refuse_unsupported(model, name)
    return body_from_model(model, text)


def _read_source(source: str | os.PathLike[str]) -> tuple[str, str, str]:
    text = os.fspath(source)
    if text.lstrip().startswith("<"):
        return text, "MJCF text", ""
    path = Path(text)
    if not path.is_file():
        raise InputError(f"{path}: no such MJCF file")
    try:
        content = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file, so not MJCF (expected XML)") from error
    if not content.strip():  # MuJoCo would blame a file of its own
        raise InputError(f"{path}: not a valid MJCF model: the file is empty")
    return content, str(path), str(path.parent)


def _with_free_root(text: str, name: str) -> str:
    """Give the first body a free joint, in the text: MuJoCo's own writer rounds numbers."""
    try:
        tree = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(f"{name}: not well-formed XML: {error}") from error
    root = tree.find("worldbody/body")
    if root is None:
        raise InputError(f"{name}: the model has no body (expected <worldbody><body>)")
    joints = [e for e in root if e.tag in ("joint", "freejoint")]
    if any(e.tag == "freejoint" or e.get("type") == "free" for e in joints):
        return text
    if joints:
        raise InputError(
            f"{name}: root body '{root.get('name')}' already has joints, so it cannot be given a "
            "free one (wrap it in an outer body)"
        )
    root.insert(0, ElementTree.Element("freejoint", name="root"))
    return ElementTree.tostring(tree, encoding="unicode")


def _refuse_unsupported(model: mujoco.MjModel, name: str) -> None:
    features = {
        "equality constraints": model.neq,
        "mocap bodies": model.nmocap,
        "flexible bodies (flex)": model.nflex,
        "plugins": model.nplugin,
    }
    used = [feature for feature, count in features.items() if count]
    if used:
        raise InputError(
            f"{name}: {', '.join(used)} not supported; supported are trees of free, ball, hinge "
            "and slide joints with sites (remove these elements)"
        )
    if model.njnt == 0:
        raise InputError(
            f"{name}: the body has no joints; it needs at least one free, ball, hinge or slide "
            "joint"
        )


def body_from_model(model: mujoco.MjModel, xml: str) -> Body:
    """Make a `Body` from a compiled model and the XML it was compiled from."""
    names = lambda kind, n: tuple(  # noqa: E731
        mujoco.mj_id2name(model, kind, i) or f"{kind.name.removeprefix('mjOBJ_').lower()}{i}"
        for i in range(n)
    )
    topology = Topology(
        body_names=names(mujoco.mjtObj.mjOBJ_BODY, model.nbody),
        body_parent=tuple(int(p) for p in model.body_parentid),
        joint_names=names(mujoco.mjtObj.mjOBJ_JOINT, model.njnt),
        joint_types=tuple(_JOINT_TYPE[mujoco.mjtJoint(t)] for t in model.jnt_type),
        joint_body=tuple(int(b) for b in model.jnt_bodyid),
        site_names=names(mujoco.mjtObj.mjOBJ_SITE, model.nsite),
        site_body=tuple(int(b) for b in model.site_bodyid),
    )
    limited = model.jnt_limited.astype(bool)[:, None]
    array = lambda x: jnp.asarray(np.array(x))  # noqa: E731
    return Body(
        body_pos=array(model.body_pos),
        body_quat=array(model.body_quat),
        joint_pos=array(model.jnt_pos),
        joint_axis=array(model.jnt_axis),
        joint_range=array(np.where(limited, model.jnt_range, [-np.inf, np.inf])),
        qpos0=array(model.qpos0),
        site_pos=array(model.site_pos),
        site_quat=array(model.site_quat),
        gravity=array(model.opt.gravity),
        topology=topology,
        xml=xml,
    )

"""The unchanging structure of a body: names, tree, joint types and where things sit in q and v."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from mocap_jax.errors import unknown_name

FREE, BALL, SLIDE, HINGE = "free", "ball", "slide", "hinge"
QPOS_WIDTH = {FREE: 7, BALL: 4, SLIDE: 1, HINGE: 1}
DOF_WIDTH = {FREE: 6, BALL: 3, SLIDE: 1, HINGE: 1}


@dataclass(frozen=True)
class Topology:
    """Tree of bodies, joints and sites; hashable, so JAX treats it as static.

    Body 0 is the world. Joints, q and v are ordered as in MuJoCo.
    """

    body_names: tuple[str, ...]
    body_parent: tuple[int, ...]
    joint_names: tuple[str, ...]
    joint_types: tuple[str, ...]
    joint_body: tuple[int, ...]
    site_names: tuple[str, ...]
    site_body: tuple[int, ...]

    @cached_property
    def _hash(self) -> int:
        return hash((self.body_names, self.body_parent, self.joint_types, self.joint_body,
                     self.site_names, self.site_body))  # fmt: skip

    def __hash__(self) -> int:
        return self._hash

    def __getstate__(self) -> dict[str, object]:
        """The fields alone: what is cached, the hash above all, holds for one process."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @cached_property
    def joint_qpos(self) -> np.ndarray:
        """First index in q of each joint."""
        widths = [QPOS_WIDTH[t] for t in self.joint_types]
        return np.concatenate([[0], np.cumsum(widths)[:-1]]).astype(int)

    @cached_property
    def joint_dof(self) -> np.ndarray:
        """First index in v of each joint."""
        widths = [DOF_WIDTH[t] for t in self.joint_types]
        return np.concatenate([[0], np.cumsum(widths)[:-1]]).astype(int)

    @property
    def nbody(self) -> int:
        return len(self.body_names)

    @property
    def njoint(self) -> int:
        return len(self.joint_names)

    @cached_property
    def nq(self) -> int:
        return sum(QPOS_WIDTH[t] for t in self.joint_types)

    @cached_property
    def nv(self) -> int:
        return sum(DOF_WIDTH[t] for t in self.joint_types)

    @cached_property
    def depth(self) -> np.ndarray:
        """Number of edges from the world to each body."""
        depth = np.zeros(self.nbody, int)
        for b in range(1, self.nbody):
            depth[b] = depth[self.body_parent[b]] + 1
        return depth

    @cached_property
    def levels(self) -> tuple[np.ndarray, ...]:
        """Bodies by depth; level 0 is the world."""
        return tuple(np.flatnonzero(self.depth == d) for d in range(self.depth.max() + 1))

    @cached_property
    def dof_joint(self) -> np.ndarray:
        """Joint of each degree of freedom."""
        return np.repeat(np.arange(self.njoint), [DOF_WIDTH[t] for t in self.joint_types])

    @cached_property
    def free_joints(self) -> tuple[int, ...]:
        """Joints that are free: the root of every person, the first one's first."""
        return tuple(j for j, kind in enumerate(self.joint_types) if kind == FREE)

    @cached_property
    def root_dofs(self) -> np.ndarray:
        """Mask (nv,): degree of freedom of a free joint."""
        return np.isin(self.dof_joint, self.free_joints)

    @cached_property
    def body_dofs(self) -> np.ndarray:
        """Mask (nbody, nv): degree of freedom moves the body."""
        mask = np.zeros((self.nbody, self.nv), bool)
        dof_body = np.asarray(self.joint_body, int)[self.dof_joint] if self.nv else np.zeros(0, int)
        for b in range(1, self.nbody):
            mask[b] = mask[self.body_parent[b]] | (dof_body == b)
        return mask

    @cached_property
    def axis_dofs(self) -> np.ndarray:
        """Mask (nv, nv): row i marks the degrees of freedom that carry the screw axis of i.

        These are all before i on its chain and those of its own joint (whose brackets cancel for
        one axis). Translations of a free joint have world axes: nothing carries them.
        """
        mask = np.zeros((self.nv, self.nv), bool)
        for i in range(self.nv):
            joint = self.dof_joint[i]
            if self.joint_types[joint] == FREE and i - self.joint_dof[joint] < 3:
                continue
            mask[i] = self.body_dofs[self.joint_body[joint]] & (self.dof_joint <= joint)
        return mask

    @cached_property
    def scalar_index(self) -> tuple[np.ndarray, np.ndarray]:
        """(indices in q, indices in v) of all coordinates that simply add."""
        in_q, in_v = [], []
        for j, kind in enumerate(self.joint_types):
            width = {FREE: 3, BALL: 0}.get(kind, 1)
            in_q += [self.joint_qpos[j] + i for i in range(width)]
            in_v += [self.joint_dof[j] + i for i in range(width)]
        return np.array(in_q, int), np.array(in_v, int)

    @cached_property
    def quat_index(self) -> tuple[np.ndarray, np.ndarray]:
        """(indices in q, shape (n, 4); indices in v, shape (n, 3)) of all quaternions."""
        in_q, in_v = [], []
        for j, kind in enumerate(self.joint_types):
            if kind in (FREE, BALL):
                shift = 3 if kind == FREE else 0
                in_q.append(self.joint_qpos[j] + shift + np.arange(4))
                in_v.append(self.joint_dof[j] + shift + np.arange(3))
        return np.array(in_q, int).reshape(-1, 4), np.array(in_v, int).reshape(-1, 3)

    def body_index(self, name: str) -> int:
        """Index of a body; raises `InputError` with the valid names."""
        return _index("body", name, self.body_names)

    def joint_index(self, name: str) -> int:
        """Index of a joint; raises `InputError` with the valid names."""
        return _index("joint", name, self.joint_names)

    def site_index(self, name: str) -> int:
        """Index of a site; raises `InputError` with the valid names."""
        return _index("site", name, self.site_names)

    def by_joint(self, q: np.ndarray) -> dict[str, tuple[float, ...]]:
        """Coordinates of a pose (nq,) by joint name, as declared poses hold them."""
        parts = np.split(np.asarray(q), self.joint_qpos[1:])
        return {n: tuple(map(float, p)) for n, p in zip(self.joint_names, parts, strict=True)}

    def joints_of_body(self, body: int) -> list[int]:
        """Joints that connect a body to its parent, in order."""
        return [j for j, b in enumerate(self.joint_body) if b == body]


def _index(what: str, name: str, names: tuple[str, ...]) -> int:
    if name not in names:
        raise unknown_name(what, name, names)
    return names.index(name)

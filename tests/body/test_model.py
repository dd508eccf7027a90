"""Loading bodies: what is read, and what is refused with which words."""

from __future__ import annotations

import jax
import numpy as np
import pytest
from sample_bodies import MIXED, sample_body

from mocap_jax.body import load_body
from mocap_jax.errors import InputError

LINK = "<body name='link'><joint name='knee'/><geom name='g' size='0.1'/></body>"


def mjcf(worldbody: str, rest: str = "") -> str:
    return f"<mujoco><worldbody>{worldbody}</worldbody>{rest}</mujoco>"


def refused(source, words: str, **options) -> None:
    with pytest.raises(InputError, match=words) as caught:
        load_body(source, **options)
    assert "\n" not in str(caught.value)


def test_reads_names_types_and_ranges() -> None:
    body = sample_body("mixed")
    topology = body.topology
    assert topology.body_names[:2] == ("world", "floating")
    assert topology.joint_types[:3] == ("free", "ball", "hinge")
    assert (body.nq, body.nv) == (body.mujoco_model().nq, body.mujoco_model().nv)
    assert body.has_free_root
    np.testing.assert_allclose(body.joint_range[topology.joint_index("hinge")], [-1, 2])
    assert np.isinf(body.joint_range[topology.joint_index("several_hinge")]).all()
    np.testing.assert_allclose(body.gravity, [0.3, -0.2, -9.7])
    assert body.qpos0[topology.joint_qpos[topology.joint_index("hinge")]] == 0.7


def test_file_and_text_give_the_same_body(tmp_path) -> None:
    path = tmp_path / "body.xml"
    path.write_text(MIXED)
    from_file, from_text = load_body(path), load_body(MIXED)
    assert from_file.topology == from_text.topology
    for a, b in zip(jax.tree.leaves(from_file), jax.tree.leaves(from_text), strict=True):
        np.testing.assert_array_equal(a, b)


def test_structure_is_static_and_hashable() -> None:
    body = load_body(MIXED)
    assert hash(body.topology) == hash(sample_body("mixed").topology)
    assert body.topology == sample_body("mixed").topology
    assert jax.tree.structure(body) == jax.tree.structure(sample_body("mixed"))


def test_unnamed_parts_get_names() -> None:
    body = load_body(mjcf("<body><joint/><geom size='1'/><site/></body>"))
    assert body.topology.joint_names == ("joint0",)
    assert body.topology.site_names == ("site0",)
    assert body.topology.body_names == ("world", "body1")


def test_free_root_is_added_once() -> None:
    welded_root = mjcf(f"<body name='pelvis'><geom size='0.1'/>{LINK}</body>")
    assert not load_body(welded_root).has_free_root
    body = load_body(welded_root, free_root=True)
    assert body.has_free_root and body.topology.joint_names == ("root", "knee")
    again = load_body(body.xml, free_root=True)
    assert again.topology == body.topology
    assert load_body(MIXED, free_root=True).topology == load_body(MIXED).topology


def test_refuses_a_free_root_where_it_cannot_be() -> None:
    refused(mjcf(LINK), "root body 'link' already has joints", free_root=True)
    refused(mjcf(""), "the model has no body", free_root=True)
    refused("<mujoco><worldbody>", "not well-formed XML", free_root=True)


def test_refuses_a_missing_file(tmp_path) -> None:
    refused(tmp_path / "none.xml", r"none\.xml: no such MJCF file")
    refused(tmp_path, "no such MJCF file")


def test_refuses_a_binary_file(tmp_path) -> None:
    path = tmp_path / "binary.xml"
    path.write_bytes(bytes(range(128, 256)) * 10)
    refused(path, r"binary\.xml: not a text file, so not MJCF")


@pytest.mark.parametrize("text", ["", "hello", "<mujoco><worldbody>", "<html></html>"])
def test_refuses_malformed_xml(tmp_path, text: str) -> None:
    path = tmp_path / "broken.xml"
    path.write_text(text)
    refused(path, r"broken\.xml: not a valid MJCF model: \S")


def test_refuses_text_that_mujoco_cannot_compile() -> None:
    screw = mjcf("<body><joint type='screw'/></body>")
    refused(screw, "^MJCF text: not a valid MJCF model: .*screw")
    refused(mjcf("<body><joint/></body>"), "not a valid MJCF model: .*mass")


def test_refuses_a_body_without_joints() -> None:
    refused(mjcf("<body><geom size='1'/></body>"), "the body has no joints; it needs at least one")
    refused(mjcf(""), "the body has no joints")


@pytest.mark.parametrize(
    ("text", "feature"),
    [
        (mjcf(LINK, "<equality><joint joint1='knee'/></equality>"), "equality constraints"),
        (mjcf(LINK + "<body mocap='true'><geom size='1'/></body>"), "mocap bodies"),
    ],
)
def test_refuses_features_without_kinematics_by_name(text: str, feature: str) -> None:
    refused(text, f"^MJCF text: {feature} not supported; supported are trees of free, ball")


def test_names_every_unsupported_feature_at_once() -> None:
    text = mjcf(
        LINK + "<body mocap='true'><geom size='1'/></body>",
        "<equality><joint joint1='knee'/></equality>",
    )
    refused(text, "equality constraints, mocap bodies not supported")


@pytest.mark.parametrize("kind", ["site", "joint", "body"])
def test_unknown_names_list_the_valid_ones(kind: str) -> None:
    topology = sample_body("mixed").topology
    with pytest.raises(InputError, match=rf"unknown {kind} 'hinj'; valid: \w+"):
        getattr(topology, f"{kind}_index")("hinj")
    with pytest.raises(InputError, match="valid: hinge,"):
        topology.joint_index("hinj")

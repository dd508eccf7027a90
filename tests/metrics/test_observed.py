"""Joints that sensors observe."""

import pytest

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.metrics import observed_segments


def chain(*joints: str) -> str:
    """A free root with a chain of bodies b1, b2, ...; site s<i> on each."""
    text, end = "", ""
    for i, joint in enumerate(joints, start=1):
        inside = {"": "", "ball": '<joint type="ball"/>'}.get(joint)
        if inside is None:
            inside = "".join(f'<joint type="hinge" axis="{a}"/>' for a in joint.split(","))
        text += (
            f'<body name="b{i}" pos="0 0 1">{inside}<geom size="0.1" mass="1"/><site name="s{i}"/>'
        )
        end += "</body>"
    return (
        '<mujoco><worldbody><body name="b0"><freejoint/><geom size="0.1" mass="1"/>'
        f'<site name="s0"/>{text}{end}</body></worldbody></mujoco>'
    )


X, XY = "1 0 0", "1 0 0,0 1 0"


@pytest.mark.parametrize(
    ("joints", "sites", "expected"),
    [
        (["ball"], ["s0", "s1"], ("b1",)),
        (["ball"], ["s0"], ()),
        (["ball"], [], ()),
        ([X, XY], ["s0", "s2"], ("b1", "b2")),
        (["ball", X], ["s0", "s2"], ()),
        (["ball", X], ["s0", "s1", "s2"], ("b1", "b2")),
        # A welded body adds no degree of freedom, and its sensor is its parent's.
        (["ball", "", X], ["s0", "s2", "s3"], ("b1", "b3")),
        ([X, "", XY], ["s0", "s3"], ("b1", "b3")),
        (["ball", "ball", "ball"], ["s1", "s2"], ("b2",)),
    ],
)
def test_chains(joints, sites, expected):
    body = load_body(chain(*joints))
    assert observed_segments(body, sites) == expected
    assert observed_segments(body, [body.site_index(s) for s in sites]) == expected


def test_chain_through_a_common_ancestor():
    arm = (
        '<body name="{0}"><joint type="hinge"/><geom size="0.1" mass="1"/><site name="{0}"/></body>'
    )
    body = load_body(
        '<mujoco><worldbody><body name="root"><freejoint/><geom size="0.1" mass="1"/>'
        f"{arm.format('left')}{arm.format('right')}</body></worldbody></mujoco>"
    )
    assert observed_segments(body, ["left", "right"]) == ("left", "right")


def test_two_bodies_in_one_world_do_not_observe_each_other():
    one = (
        '<body name="{0}"><joint type="ball"/><geom size="0.1" mass="1"/><site name="{0}"/></body>'
    )
    body = load_body(f"<mujoco><worldbody>{one.format('a')}{one.format('b')}</worldbody></mujoco>")
    assert observed_segments(body, ["a", "b"]) == ()


def test_unknown_site_is_named():
    with pytest.raises(InputError, match="'s9'.*s0"):
        observed_segments(load_body(chain("ball")), ["s9"])

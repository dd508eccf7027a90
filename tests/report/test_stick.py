"""Drawings: bones where the joints are, the reference behind the estimate."""

import dataclasses

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from small_person import person, recording, solution, swing

from mocap_jax.report import motion_strip, plot_body
from mocap_jax.report.stick import bones, facing, view_from
from mocap_jax.report.style import INK
from mocap_jax.solution.anatomy import anatomical_frames
from mocap_jax.solution.poses import segment_poses


@pytest.fixture(scope="module")
def body():
    return person()


def test_bones_join_the_joints(body):
    R, p = segment_poses(body, np.asarray(body.qpos0)[None])
    shape = bones(body, R[0], p[0], anatomical_frames(body))
    names = body.topology.body_names
    forearm = p[0, names.index("LeftForeArm")]
    assert any(np.allclose(end, forearm) for end in shape.end)
    assert len(shape.heads) == 1 and shape.heads[0][2] > 1.5
    # Feet point forward (+x), hands outward.
    foot = p[0, names.index("LeftFoot")]
    tip = next(e for s, e in zip(shape.start, shape.end, strict=True) if np.allclose(s, foot))
    np.testing.assert_allclose((tip - foot) / np.linalg.norm(tip - foot), [1, 0, 0], atol=1e-9)


def test_facing_and_view(body):
    R, _ = segment_poses(body, np.asarray(body.qpos0)[None])
    assert facing(body, R) == pytest.approx(0.0)
    view = view_from(0.0, turn=0.0, tilt=0.0)
    # From straight ahead the person's left is on the viewer's right.
    np.testing.assert_allclose(view.flat(np.array([[5.0, 1.0, 2.0]])), [[1.0, 2.0]], atol=1e-12)


def test_strip_draws_both(body, tmp_path):
    motion = swing(body)
    made = solution(body, motion)
    alone = len(motion_strip(made, poses=4).axes[0].collections)
    both = motion_strip(made, recording(motion), poses=4)
    assert len(both.axes[0].collections) > alone
    # Last of each pose: lines of the estimate, then of the truth, over all limbs.
    top = max(c.get_zorder() for c in both.axes[0].collections[: alone // 4])
    lines = [c for c in both.axes[0].collections if c.get_zorder() == 20]
    assert len(lines) == 2 * 4 and top < 20
    assert to_hex(lines[1].get_colors()[0]) == INK
    assert [t.get_text() for t in both.axes[0].texts][0] == "0.0 s"
    both.savefig(tmp_path / "strip.png")


@pytest.mark.parametrize("climb", [0.0, 8.0])
def test_times_of_a_strip_stay_inside(body, climb):
    """A root that drifts upwards shrinks the poses, not the room for the text."""
    motion = swing(body)
    q = np.array(motion.q)
    q[:, 2] += climb * np.linspace(0, 1, len(q))
    figure = motion_strip(solution(body, dataclasses.replace(motion, q=q)), poses=8)
    renderer = FigureCanvasAgg(figure).get_renderer()
    assert all(t.get_window_extent(renderer).y0 >= 0 for t in figure.axes[0].texts)


def test_plot_body_on_own_axes(body):
    axes = Figure().add_subplot(xlim=(-1, 1), ylim=(0, 2))
    plot_body(axes, body, np.asarray(body.qpos0))
    assert len(axes.collections) > 10

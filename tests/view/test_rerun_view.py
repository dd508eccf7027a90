"""What Rerun is given is what the solution says."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from small_person import SENSORS, person, recording, solution, swing

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.solution.angles import joint_angles
from mocap_jax.solution.poses import segment_poses
from mocap_jax.view import save_view, show_view
from mocap_jax.view.rerun_view import _starts
from mocap_jax.view.shapes import Rounds, segment_shapes


def test_file_holds_poses_angles_and_truth(tmp_path):
    pytest.importorskip("rerun")
    chunk = pytest.importorskip("rerun.chunk", reason="reading back needs a newer Rerun")
    motion = swing(person())
    mine = solution(person(), motion)
    path = tmp_path / "a.rrd"
    save_view(path, {"mine": mine}, recording(motion))
    assert [p.name for p in tmp_path.iterdir()] == ["a.rrd"]
    chunks = {}
    for c in chunk.RrdReader(str(path)).stream().to_chunks():
        chunks.setdefault(c.entity_path, []).append(c)
    R, p = segment_poses(mine.body, np.asarray(mine.trajectory.q))
    names = mine.body.topology.body_names[1:]
    for name in names:
        moving = [c for c in chunks[f"/world/mine/{name}"] if not c.is_static]
        columns = moving[0].to_record_batch().to_pydict()
        shown = np.array(columns["Transform3D:translation"]).reshape(-1, 3)
        i = mine.body.topology.body_index(name)
        np.testing.assert_allclose(shown, p[:, i], atol=1e-6)
        matrix = np.array(columns["Transform3D:mat3x3"]).reshape(-1, 3, 3)
        # Rerun's matrices stand column after column.
        np.testing.assert_allclose(matrix.swapaxes(1, 2), R[:, i], atol=1e-6)
        seconds = np.array([t.total_seconds() for t in columns["time"]])
        np.testing.assert_allclose(seconds, mine.trajectory.time, atol=1e-6)
        assert f"/world/truth/{name}" in chunks
    labels, angles = joint_angles(mine.body, mine.trajectory)
    drawn = [c for c in chunks[f"/angles/{labels[0]}/mine"] if not c.is_static]
    values = np.array(drawn[0].to_record_batch().to_pydict()["Scalars:scalars"]).ravel()
    np.testing.assert_allclose(values, np.rad2deg(angles[:, 0]), atol=1e-9)
    sensors = {k.split("/")[3] for k in chunks if k.endswith("/sensors") and "/mine/" in k}
    assert len(sensors) == len(SENSORS)


def test_shapes_stand_in_their_segment():
    body = load_body("""<mujoco><worldbody><geom type="plane" size="1 1 1"/>
      <body name="a"><freejoint/><site name="s" pos="0 0 .1"/>
        <geom type="capsule" fromto="0 0 0 0 .4 0" size=".05"/>
        <geom type="box" size=".1 .2 .3" pos="1 0 0"/>
        <body name="b" pos="0 .4 0"><joint type="ball"/><geom size=".07"/></body>
      </body></worldbody></mujoco>""")
    shapes = segment_shapes(body)
    assert list(shapes) == ["a", "b"]
    (start,) = _starts(shapes["a"].capsules)
    (size,) = shapes["a"].capsules.size
    (quaternion,) = shapes["a"].capsules.quaternion
    # The capsule goes from one end to the other, whichever MuJoCo took for the first.
    x, y, z, w = quaternion
    along = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    ends = sorted([tuple(np.round(start, 9)), tuple(np.round(start + 2 * size[1] * along, 9))])
    np.testing.assert_allclose(ends, [(0, 0, 0), (0, 0.4, 0)], atol=1e-9)
    np.testing.assert_allclose(shapes["a"].boxes.size, [[0.1, 0.2, 0.3]])
    np.testing.assert_allclose(shapes["b"].ellipsoids.size, [[0.07] * 3])
    np.testing.assert_allclose(shapes["a"].bones, [[[0, 0, 0], [0, 0.4, 0]]])
    np.testing.assert_allclose(shapes["a"].sites["s"], [0, 0, 0.1])
    assert shapes["b"].capsules == Rounds()


def test_without_rerun_one_line_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "rerun", None)
    mine = solution(person(), swing(person()))
    with pytest.raises(InputError, match=r"pip install 'mocap_jax\[viewer\]'"):
        show_view({"mine": mine})
    with pytest.raises(InputError, match=r"pip install 'mocap_jax\[viewer\]'"):
        save_view(tmp_path / "a.rrd", {"mine": mine})
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="others have no DISPLAY")
def test_without_a_display_a_file_is_proposed(monkeypatch):
    pytest.importorskip("rerun")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(InputError, match="no display .* -o FILE.rrd"):
        show_view({"mine": solution(person(), swing(person()))})

"""What is written is read back; other programs' decoders see the same."""

from __future__ import annotations

import dataclasses
import time

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from io_samples import SENSORS, START, XML, random_inertial, random_recording, unit
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoder
from mcap_ros2.decoder import DecoderFactory as RosDecoder

from mocap_jax.errors import InputError
from mocap_jax.io import read_recording, validate_recording, write_recording
from mocap_jax.recording import InertialStream, RangeStream, Recording, Setup, Truth
from mocap_jax.trajectory import Trajectory

EMPTY = Recording({}, None, None, {}, None, None, Setup(), None)


def assert_same(a: Recording, b: Recording) -> None:
    """All values bit for bit, all times to a nanosecond, everything declared."""
    assert jax.tree.structure(a) == jax.tree.structure(b)
    for (path, x), y in zip(jax.tree_util.tree_flatten_with_path(a)[0], jax.tree.leaves(b),
                            strict=True):  # fmt: skip
        if jax.tree_util.keystr(path).endswith(".time"):
            np.testing.assert_allclose(x, y, atol=1e-9, rtol=0)
        else:
            np.testing.assert_array_equal(np.asarray(x), np.asarray(y), err_msg=str(path))


@pytest.mark.parametrize("start", [0, START])
def test_round_trip(tmp_path, body, start) -> None:
    recording = dataclasses.replace(random_recording(body), start_utc_ns=start)
    write_recording(tmp_path / "a.mcap", recording)
    again = read_recording(tmp_path / "a.mcap")
    assert_same(recording, again)
    # A second trip changes nothing at all.
    write_recording(tmp_path / "b.mcap", again)
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()
    assert [p.name for p in sorted(tmp_path.iterdir())] == ["a.mcap", "b.mcap"]


def test_small_recordings_round_trip(tmp_path) -> None:
    no_ranges = RangeStream(
        *(np.zeros(0), np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros(0)),
        ("source/a",), ("b",),
    )  # fmt: skip
    rng = np.random.default_rng(0)
    for recording in (
        EMPTY,
        dataclasses.replace(EMPTY, body_xml=XML, subject="a/b"),
        dataclasses.replace(EMPTY, ranges=no_ranges),
        dataclasses.replace(EMPTY, inertial={"x y": random_inertial(rng, 5)}),
    ):
        write_recording(tmp_path / "a.mcap", recording)
        assert_same(recording, read_recording(tmp_path / "a.mcap"))


@settings(max_examples=20, deadline=None)
@given(
    values=arrays(np.float64, (4, 10), elements=st.floats(width=64, allow_infinity=True)),
    times=st.lists(st.integers(0, 10**15), min_size=4, max_size=4),
    name=st.text(st.characters(codec="utf-8", exclude_characters="\0"), min_size=1, max_size=12),
)
def test_any_doubles_survive(tmp_path_factory, values, times, name) -> None:
    folder = tmp_path_factory.mktemp("io")
    stream = InertialStream(np.array(times) / 1e9, values[:, :3], values[:, 3:6], values[:, 6:])
    recording = dataclasses.replace(EMPTY, inertial={name: stream})
    write_recording(folder / "a.mcap", recording)
    again = read_recording(folder / "a.mcap").inertial[name]
    np.testing.assert_array_equal(again.accelerometer, stream.accelerometer)
    np.testing.assert_array_equal(again.gyroscope, stream.gyroscope)
    np.testing.assert_array_equal(again.orientation, stream.orientation)
    np.testing.assert_allclose(again.time, stream.time, atol=1e-9)


def test_other_decoders_read_the_same(tmp_path, body) -> None:
    recording = random_recording(body, n=40)
    write_recording(tmp_path / "a.mcap", recording)
    found: dict[str, list] = {}
    with open(tmp_path / "a.mcap", "rb") as stream:
        reader = make_reader(stream, decoder_factories=[RosDecoder(), ProtobufDecoder()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message, decoded))
        assert {a.name for a in reader.iter_attachments()} >= {"body.xml", "setup.toml"}
    for sensor in SENSORS:
        expected = recording.inertial[sensor]
        for i, (message, imu) in enumerate(found[f"/inertial/{sensor}"]):
            stamp = imu.header.stamp.sec * 10**9 + imu.header.stamp.nanosec
            assert stamp == message.log_time and imu.header.frame_id == sensor
            assert abs(stamp - START - expected.time[i] * 1e9) <= 1
            w, a, o = imu.angular_velocity, imu.linear_acceleration, imu.orientation
            _check_vector([w.x, w.y, w.z], expected.gyroscope[i], imu.angular_velocity_covariance)
            _check_vector(
                [a.x, a.y, a.z], expected.accelerometer[i], imu.linear_acceleration_covariance
            )
            if imu.orientation_covariance[0] == -1:
                assert np.isnan(expected.orientation[i]).all()
            else:
                np.testing.assert_array_equal([o.w, o.x, o.y, o.z], expected.orientation[i])
    _, state = found["/truth/joint_states"][3]
    assert state.name[:4] == ["root:x", "root:y", "root:z", "root:qw"]
    assert state.name[7:12] == ["RightHip:qw", "RightHip:qx", "RightHip:qy", "RightHip:qz",
                                "RightKnee"]  # fmt: skip
    np.testing.assert_array_equal(state.position, recording.truth.trajectory.q[3])
    assert list(state.velocity) == [] and list(state.effort) == []
    _, rates = found["/truth/joint_velocities"][3]
    np.testing.assert_array_equal(rates.velocity, recording.truth.trajectory.v[3])
    _, distance = found["/range"][5]
    assert distance.distance_m == recording.ranges.distance[5]
    assert distance.receiver == SENSORS[recording.ranges.receiver[5]]
    _, tree = found["/truth/transforms"][0]
    assert tree.transforms[1].parent_frame_id == "truth/Pelvis"
    assert found["/temperature"][0][1].temperature == 21.7
    assert found["/root"][0][1].pose.orientation.w == recording.root.orientation[0, 0]
    np.testing.assert_array_equal(
        found["/magnetic/pelvis"][2][1].magnetic_field.x, recording.magnetic["pelvis"].field[2, 0]
    )


def _check_vector(found, expected, covariance) -> None:
    assert (covariance[0] == -1) == bool(np.isnan(expected).all())
    np.testing.assert_array_equal(found, expected)


def test_messages_by_another_writer(tmp_path) -> None:
    """Changing frame ids defeat the array decoder; each message is then decoded by itself."""
    from mcap_ros2.writer import Writer

    from mocap_jax.io.ros_messages import IMU, ROS_SCHEMAS

    vector = lambda x, y, z: {"x": x, "y": y, "z": z}  # noqa: E731
    with open(tmp_path / "a.mcap", "wb") as stream, Writer(stream) as writer:
        schema = writer.register_msgdef(IMU, ROS_SCHEMAS[IMU])
        for i in range(3):
            writer.write_message("/inertial/a", schema, {
                "header": {"stamp": {"sec": 5, "nanosec": 10 * i}, "frame_id": "x" * i},
                "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
                "orientation_covariance": [-1.0] + [0.0] * 8,
                "angular_velocity": vector(1.0 + i, 2.0, 3.0),
                "angular_velocity_covariance": [0.0] * 9,
                "linear_acceleration": vector(4.0, 5.0, 9.81),
                "linear_acceleration_covariance": [0.0] * 9,
            }, log_time=5 * 10**9 + 10 * i)  # fmt: skip
    stream = read_recording(tmp_path / "a.mcap").inertial["a"]
    np.testing.assert_array_equal(stream.gyroscope, [[1, 2, 3], [2, 2, 3], [3, 2, 3]])
    np.testing.assert_array_equal(stream.accelerometer[2], [4.0, 5.0, 9.81])
    assert np.isnan(stream.orientation).all()
    np.testing.assert_allclose(stream.time, [0, 1e-8, 2e-8], atol=1e-12)


def test_backward_time_is_not_repaired(tmp_path, body) -> None:
    recording = random_recording(body)
    stream = recording.inertial["pelvis"]
    backwards = dataclasses.replace(stream, time=np.where(np.arange(400) == 200, 0.1, stream.time))
    inertial = {**recording.inertial, "pelvis": backwards}
    write_recording(tmp_path / "a.mcap", dataclasses.replace(recording, inertial=inertial))
    again = read_recording(tmp_path / "a.mcap")
    np.testing.assert_allclose(again.inertial["pelvis"].time, backwards.time, atol=1e-9)
    with pytest.raises(InputError, match="pelvis: time goes backwards at sample 200"):
        validate_recording(again)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0, 3e9])
def test_times_that_cannot_be_stored(tmp_path, bad) -> None:
    stream = random_inertial(np.random.default_rng(0), 8)
    stream.time[3] = bad
    with pytest.raises(InputError, match="time"):
        write_recording(tmp_path / "a.mcap", dataclasses.replace(EMPTY, inertial={"a": stream}))
    assert not list(tmp_path.iterdir())


def test_a_minute_of_a_full_suit_takes_seconds(tmp_path) -> None:
    rng, boards, n, m = np.random.default_rng(0), 18, 5600, 90_000
    names = tuple(f"sensor_{i}" for i in range(boards))
    recording = dataclasses.replace(
        EMPTY,
        inertial={s: random_inertial(rng, n) for s in names},
        ranges=RangeStream(
            np.sort(rng.uniform(0, 40, m)), rng.integers(0, 8, m), rng.integers(0, boards, m),
            rng.uniform(0, 2, m), rng.uniform(0, 1, m),
            tuple(f"source/{i}" for i in range(8)), names,
        ),
    )  # fmt: skip
    start = time.process_time()
    write_recording(tmp_path / "a.mcap", recording)
    written = time.process_time()
    assert_same(recording, read_recording(tmp_path / "a.mcap"))
    # Several times what it takes, so that a busy machine does not fail it.
    assert written - start < 15.0 and time.process_time() - written < 10.0


def test_truth_must_fit_its_body(tmp_path) -> None:
    truth = Truth(Trajectory(np.arange(3.0), unit(np.ones((3, 5)))), XML)
    with pytest.raises(InputError, match="does not fit"):
        write_recording(tmp_path / "a.mcap", dataclasses.replace(EMPTY, truth=truth))
    assert not list(tmp_path.iterdir())

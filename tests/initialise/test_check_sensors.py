"""Swapped sensors, wrong units and turned boards are named; ordinary errors raise no alarm."""

import dataclasses
import itertools

import numpy as np
import pytest

from mocap_jax.body import load_body
from mocap_jax.errors import InputError
from mocap_jax.initialise import SensorCheck, check_sensors
from mocap_jax.initialise.sensor_assignment import neighbours
from mocap_jax.motion import builtin_motion
from mocap_jax.motion.motion import Motion
from mocap_jax.recording import cut
from mocap_jax.simulation import SimulationOptions, simulate
from mocap_jax.trajectory import Trajectory

SAME = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
LIKELY_SWAPS = [
    ("left_hand", "right_hand"), ("left_forearm", "left_upper_arm"),
    ("right_forearm", "right_hand"), ("left_thigh", "left_shank"),
    ("left_thigh", "right_thigh"), ("left_foot", "right_foot"), ("pelvis", "chest"),
    ("abdomen", "head"), ("left_shoulder", "right_shank"),
]  # fmt: skip


def walk(seed, profile="field", **options):
    """The rest hold and five seconds of walking with all errors of the field profile."""
    motion = builtin_motion("walking")
    time = np.asarray(motion.trajectory.time)
    first = time <= time[0] + 4.0
    short = Trajectory(motion.trajectory.time[first], motion.trajectory.q[first])
    return simulate(
        Motion(motion.name, motion.body, short, motion.facts), profile=profile, seed=seed,
        options=SimulationOptions(**options),
    )  # fmt: skip


@pytest.fixture(scope="module")
def recording():
    return walk(3)


@pytest.fixture(scope="module")
def body(recording):
    return load_body(recording.body_xml)


def renamed(recording, names):
    """Boards carried under other names: `names[a]` is what the data of board a are called."""
    name = lambda n: names.get(n, n)  # noqa: E731
    by_name = {name(n): stream for n, stream in recording.inertial.items()}
    inertial = {n: by_name[n] for n in recording.inertial}
    ranges = recording.ranges
    if ranges is not None:
        receivers = tuple(name(n) for n in ranges.receiver_names)
        ranges = dataclasses.replace(ranges, receiver_names=receivers)
    return dataclasses.replace(recording, inertial=inertial, ranges=ranges)


def rewired(recording, a, b):
    """The inertial data of two boards exchanged; their receivers stay where they are."""
    both = {a: recording.inertial[b], b: recording.inertial[a]}
    return dataclasses.replace(recording, inertial=recording.inertial | both)


def crossed(recording, a, b):
    """The distances of two boards exchanged; their inertial data stay where they are."""
    names = {a: b, b: a}
    receivers = tuple(names.get(n, n) for n in recording.ranges.receiver_names)
    ranges = dataclasses.replace(recording.ranges, receiver_names=receivers)
    return dataclasses.replace(recording, ranges=ranges)


def changed(recording, sensor, accelerometer=SAME, gyroscope=SAME):
    """One board's readings multiplied by matrices."""
    stream = recording.inertial[sensor]
    stream = dataclasses.replace(
        stream,
        accelerometer=np.asarray(stream.accelerometer) @ np.asarray(accelerometer).T,
        gyroscope=np.asarray(stream.gyroscope) @ np.asarray(gyroscope).T,
    )
    return dataclasses.replace(recording, inertial=recording.inertial | {sensor: stream})


def suspects(check):
    return {name for name, texts in check.findings.items() if texts}


@pytest.mark.parametrize("with_ranges", [True, False])
def test_ordinary_errors_raise_no_alarm(recording, body, with_ranges):
    plain = recording if with_ranges else dataclasses.replace(recording, ranges=None)
    check = check_sensors(plain, body)
    assert check.ok and not check.sentences and not check.remarks
    assert set(check.measures) == set(recording.inertial)
    tilt = [m["tilt_deg"] for m in check.measures.values()]
    assert 1.0 < max(tilt) < 40.0
    distance = np.array([m["distance_error"] for m in check.measures.values()])
    assert np.isfinite(distance).any() == with_ranges


@pytest.mark.parametrize("profile", ["ideal", "paper", "field"])
def test_quaternions_of_another_order_are_named(profile):
    sound = walk(1, profile, orientations=True)
    assert check_sensors(sound).ok, str(check_sensors(sound))
    xyzw = lambda s: dataclasses.replace(s, orientation=np.roll(s.orientation, -1, axis=1))  # noqa: E731
    text = "quaternions look like xyzw, read as wxyz"
    boards = {name: xyzw(stream) for name, stream in sound.inertial.items()}
    check = check_sensors(dataclasses.replace(sound, inertial=boards))
    moving = {"pelvis", "left_thigh", "right_thigh", "left_shank", "right_shank", "right_forearm"}
    assert moving <= {n for n, texts in check.faults.items() if texts == (text,)}, str(check)
    assert check.root is None and not check.exchanged
    check = check_sensors(dataclasses.replace(sound, root=xyzw(sound.root)))
    assert check.sentences == (f"The measured root: {text}.",) and not check.ok


@pytest.fixture(scope="module", params=["paper", "field"])
def moving(request):
    """Ten seconds of walking from the middle of a step on; boards tell orientations."""
    motion = builtin_motion("walking")
    whole = simulate(
        motion, profile=request.param, seed=4, options=SimulationOptions(orientations=True)
    )
    return cut(whole, whole.setup.score_from + 0.7, whole.interval[1])


def test_a_start_in_motion_raises_no_alarm(moving):
    check = check_sensors(moving)
    assert check.ok and "start is not still" in check.remarks[0], str(check)
    assert set(check.measures) == set(moving.inertial) == set(check.faults)


def test_a_start_in_motion_hides_neither_units_nor_orders(moving):
    in_g = changed(moving, "chest", accelerometer=np.eye(3) / 9.80665)
    check = check_sensors(in_g)
    assert suspects(check) == {"chest"} and "reads in g" in check.faults["chest"][0], str(check)
    xyzw = lambda s: dataclasses.replace(s, orientation=np.roll(s.orientation, -1, axis=1))  # noqa: E731
    check = check_sensors(dataclasses.replace(moving, root=xyzw(moving.root)))
    assert check.root == "quaternions look like xyzw, read as wxyz"
    boards = {name: xyzw(stream) for name, stream in moving.inertial.items()}
    check = check_sensors(dataclasses.replace(moving, inertial=boards))
    assert {"pelvis", "left_thigh", "left_shank"} <= suspects(check)


@pytest.mark.parametrize("with_ranges", [True, False])
@pytest.mark.parametrize("pair", LIKELY_SWAPS, ids="-".join)
def test_swapped_pairs_are_named(recording, body, pair, with_ranges):
    a, b = pair
    wrong = renamed(recording, {a: b, b: a})
    check = check_sensors(wrong if with_ranges else dataclasses.replace(wrong, ranges=None), body)
    assert [set(group) for group in check.exchanged] == [{a, b}]
    assert suspects(check) == {a, b}
    assert f"the place of {b}" in check.findings[a][0]
    assert len(check.sentences) == 1 and a in check.sentences[0] and b in check.sentences[0]


@pytest.mark.parametrize(
    "pair",
    [*LIKELY_SWAPS, ("abdomen", "left_hand"), ("left_hand", "left_shank"), ("pelvis", "left_foot"),
     ("chest", "left_shank"), ("left_forearm", "right_shank")],
    ids="-".join,
)  # fmt: skip
def test_exchanged_cables_are_named(recording, body, pair):
    """Distances that fit where they are do not hide what gravity and rates say, nor warp it."""
    check = check_sensors(rewired(recording, *pair), body)
    assert [set(group) for group in check.exchanged] == [set(pair)]
    assert suspects(check) == set(pair) and not any(check.faults.values())
    if pair in (("left_hand", "right_hand"), ("chest", "left_shank")):  # both hear sources
        assert check.inertial_only == check.exchanged
        assert "inertial data" in check.findings[pair[0]][0]
        assert "Their distances fit where they are" in check.sentences[0]


def test_whole_boards_are_told_from_cables(recording, body):
    names = {"left_hand": "right_hand", "right_hand": "left_hand"}
    assert not check_sensors(renamed(recording, names), body).inertial_only
    deaf = dataclasses.replace(rewired(recording, "left_hand", "right_hand"), ranges=None)
    check = check_sensors(deaf, body)
    assert check.exchanged and not check.inertial_only, "without distances nothing tells"


@pytest.mark.parametrize(
    "pair",
    [("left_hand", "right_hand"), ("pelvis", "chest"), ("left_thigh", "left_shank"),
     ("chest", "left_shank")],
    ids="-".join,
)  # fmt: skip
def test_exchanged_receivers_are_named(recording, body, pair):
    check = check_sensors(crossed(recording, *pair), body)
    assert [set(group) for group in check.exchanged] == [set(pair)]
    assert check.ranges_only == check.exchanged and not check.inertial_only
    assert suspects(check) == set(pair) and not any(check.faults.values())
    assert "distances look swapped: they fit the place of" in check.findings[pair[0]][0]
    assert "Their inertial data fit where they are" in check.sentences[0]


def test_doubtful_inertial_data_are_not_called_exchanged_cables(recording, body):
    """A gyroscope of wrong unit, or without signal, is not taken for one of a board at rest."""
    for fault in (180 / np.pi * np.eye(3), np.zeros((3, 3))):
        check = check_sensors(changed(recording, "left_thigh", gyroscope=fault), body)
        assert not check.exchanged and suspects(check) <= {"left_thigh"}


def test_three_exchanged_boards_are_one_group(recording, body):
    names = {"left_hand": "right_foot", "right_foot": "chest", "chest": "left_hand"}
    check = check_sensors(renamed(recording, names), body)
    assert len(check.exchanged) == 1 and suspects(check) == set(names)
    # What is called right_foot was worn on the left hand, and so on.
    for worn, called in names.items():
        assert f"fits the place of {worn} " in check.findings[called][0]


@pytest.mark.parametrize("sensor", ["pelvis", "left_hand", "right_foot"])
@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ({"accelerometer": np.eye(3) / 9.80665}, "reads in g;"),
        ({"accelerometer": 1000 * np.eye(3) / 9.80665}, "reads in mg;"),
        ({"gyroscope": 180 / np.pi * np.eye(3)}, "reads in deg/s;"),
        ({"accelerometer": -np.eye(3)}, "sign of the accelerometer"),
    ],
    ids=["g", "mg", "deg/s", "accelerometer-sign"],
)
def test_units_and_signs_are_named(recording, body, sensor, fault, says):
    check = check_sensors(changed(recording, sensor, **fault), body)
    assert suspects(check) == {sensor} and not check.exchanged
    assert says in check.findings[sensor][0]
    assert sensor in check.sentences[0]


@pytest.mark.parametrize("sensor", ["left_hand", "right_foot"])
def test_reversed_gyroscope_of_a_limb_is_named(recording, body, sensor):
    # A pelvis that hardly turns does not tell the sign.
    check = check_sensors(changed(recording, sensor, gyroscope=-np.eye(3)), body)
    assert suspects(check) == {sensor} and "opposite sign" in check.findings[sensor][0]


def test_turned_boards_are_named(recording, body):
    flip = np.diag([-1.0, -1.0, 1.0])
    check = check_sensors(changed(recording, "left_forearm", flip, flip), body)
    assert suspects(check) == {"left_forearm"} and "upside down" in check.sentences[0]
    turn = np.eye(3)[[1, 2, 0]]
    check = check_sensors(changed(recording, "right_thigh", turn, turn), body)
    assert suspects(check) == {"right_thigh"} and "axes exchanged" in check.sentences[0]


def test_swap_and_unit_together(recording, body):
    both = renamed(recording, {"left_hand": "left_foot", "left_foot": "left_hand"})
    both = changed(both, "left_hand", gyroscope=180 / np.pi * np.eye(3))
    check = check_sensors(both, body)
    assert [set(group) for group in check.exchanged] == [{"left_hand", "left_foot"}]
    assert any("deg/s" in text for text in check.findings["left_hand"])


def test_silent_gyroscope_blames_itself_alone(recording, body):
    check = check_sensors(changed(recording, "left_shank", gyroscope=np.zeros((3, 3))), body)
    assert not check.exchanged and suspects(check) <= {"left_shank"}


@pytest.mark.parametrize("absent", ["gyroscope", "accelerometer"])
@pytest.mark.parametrize("boards", [["left_shank"], None], ids=["one", "all"])
def test_absent_readings_are_no_fault(recording, body, absent, boards):
    """Swaps of other boards are found from what is left."""
    gone = {absent: np.full((3, 3), np.nan)}
    less = renamed(recording, {"left_hand": "head", "head": "left_hand"})
    for name in boards or recording.inertial:
        less = changed(less, name, **gone)
    check = check_sensors(less, body)
    assert [set(group) for group in check.exchanged] == [{"left_hand", "head"}]
    assert suspects(check) == {"left_hand", "head"}


def test_without_rest_or_inertial_data_nothing_is_claimed(recording):
    moving = dataclasses.replace(
        recording,
        setup=dataclasses.replace(recording.setup, rest=None),
        inertial={
            n: dataclasses.replace(s, time=np.asarray(s.time)[-280:],
                                   accelerometer=np.asarray(s.accelerometer)[-280:],
                                   gyroscope=np.asarray(s.gyroscope)[-280:],
                                   orientation=np.asarray(s.orientation)[-280:])
            for n, s in recording.inertial.items()
        },
        root=None, ranges=None,
    )  # fmt: skip
    check = check_sensors(moving)
    assert check.ok and "no rest hold" in check.remarks[0]
    assert check_sensors(dataclasses.replace(recording, inertial={})).remarks
    with pytest.raises(InputError, match="no body"):
        check_sensors(dataclasses.replace(recording, body_xml=None))


def test_undeclared_rest_is_compared_leniently(recording, body):
    undeclared = dataclasses.replace(
        recording, setup=dataclasses.replace(recording.setup, rest=None)
    )
    check = check_sensors(undeclared, body)
    assert check.ok and "No rest pose is declared" in check.remarks[0]


def test_text_of_a_check():
    assert "No sensor" in str(SensorCheck({"a": ()}))
    both = SensorCheck({"a": ("reads in g",), "b": ("reads in g",)})
    assert str(both) == "Sensors a, b: reads in g."


def test_neighbours_follow_the_tree(body):
    topology = body.topology
    segments = tuple(topology.body_index(n) for n in ("LeftHand", "Pelvis", "LeftUpperArm"))
    edges = {frozenset(e) for e in neighbours(topology, segments)}
    assert edges == {frozenset({0, 2}), frozenset({1, 2})}
    hand = topology.body_index("LeftHand")
    assert neighbours(topology, (hand, hand)) == [(0, 1)]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_every_pair_over_seeds(seed):
    """Detection and false alarm rates over all pairs; prints them (`pytest -s`)."""
    recording = walk(seed)
    body = load_body(recording.body_xml)
    missed = []
    assert check_sensors(recording, body).ok
    pairs = list(itertools.combinations(recording.inertial, 2))
    for a, b in pairs:
        check = check_sensors(renamed(recording, {a: b, b: a}), body)
        if [set(g) for g in check.exchanged] != [{a, b}] or suspects(check) != {a, b}:
            missed.append((a, b))
        check = check_sensors(rewired(recording, a, b), body)
        if any(set(g) != {a, b} for g in check.exchanged) or not suspects(check) <= {a, b}:
            missed.append((a, b, "cables"))
        check = check_sensors(crossed(recording, a, b), body)
        if any(set(g) != {a, b} for g in check.exchanged) or not suspects(check) <= {a, b}:
            missed.append((a, b, "receivers"))
    print(f"seed {seed}: {len(pairs) - len(missed)} of {len(pairs)} swaps named; missed {missed}")
    assert not missed


def test_too_little_motion_names_no_unit(recording):
    short = {
        name: dataclasses.replace(
            s, **{f: np.asarray(getattr(s, f))[np.asarray(s.time) < 3.8]
                  for f in ("time", "accelerometer", "gyroscope", "orientation")}
        )
        for name, s in recording.inertial.items()
    }  # fmt: skip
    check = check_sensors(dataclasses.replace(recording, inertial=short))
    assert suspects(check) == set()

"""Solutions of another recording are recognised; those of the same one are not suspected."""

import dataclasses

import numpy as np
from small_person import person, recording, solution, swing

from mocap_jax.metrics.relation import contradictions, signs_of_another_recording
from mocap_jax.recording import RestHold
from mocap_jax.trajectory import Trajectory


def pair():
    motion = swing(person())
    reference = recording(motion)
    return dataclasses.replace(solution(person(), motion), setup=reference.setup), reference


def test_own_recording_and_own_solution():
    mine, reference = pair()
    assert not signs_of_another_recording(mine, reference)
    assert not signs_of_another_recording(mine, mine)
    assert not contradictions(mine, reference) and not contradictions(mine, mine)


def test_what_differs_is_named():
    mine, reference = pair()
    with_setup = lambda **changes: dataclasses.replace(  # noqa: E731
        reference, setup=dataclasses.replace(reference.setup, **changes)
    )
    fewer = with_setup(sensors=reference.setup.sensors[1:])
    assert "pelvis on one side only" in signs_of_another_recording(mine, fewer)[0]
    rest = with_setup(rest=RestHold(0.0, 0.3))
    assert signs_of_another_recording(mine, rest) == ("the declared rest holds differ",)
    known = lambda **facts: dataclasses.replace(  # noqa: E731
        mine, setup=dataclasses.replace(mine.setup, provenance=facts)
    )
    facts, other = known(motion="walk", seed=1), known(motion="run", profile="x")
    assert signs_of_another_recording(facts, other) == (
        "motion differs (walk here, run in the reference)",
    )


def test_frames_beyond_the_reference():
    mine, reference = pair()
    time = np.asarray(mine.trajectory.time)
    late = Trajectory(time + time[-1], mine.trajectory.q, mine.trajectory.v)
    signs = signs_of_another_recording(dataclasses.replace(mine, trajectory=late), reference)
    assert len(signs) == 1 and "lie outside" in signs[0]


def facts(source, **known):
    return dataclasses.replace(source, setup=dataclasses.replace(source.setup, provenance=known))


def test_another_motion_contradicts_and_another_seed_does_not():
    mine, reference = pair()
    walk, run = facts(mine, motion="walk", seed=1), facts(reference, motion="run", seed=2)
    assert contradictions(walk, run) == ("motion differs (walk here, run in the reference)",)
    assert len(signs_of_another_recording(walk, run)) == 2
    assert contradictions(walk, facts(reference, motion="walk", seed=2)) == ()
    other = dataclasses.replace(reference, subject="b")
    assert "subject differs" in contradictions(facts(mine, subject="a"), other)[0]


def test_frames_beyond_a_whole_recording_contradict():
    mine, reference = pair()
    time = np.asarray(mine.trajectory.time)
    late = dataclasses.replace(mine, trajectory=Trajectory(time + time[-1], mine.trajectory.q))
    assert "lie outside" in contradictions(late, reference)[0]
    cut = dataclasses.replace(reference, salvage=("the file ends early",))
    assert contradictions(late, cut) == ()
    assert contradictions(late, mine) == (), "two solutions may cover different parts"


def test_another_body_contradicts_only_beside_another_sign():
    mine, reference = pair()
    taller = dataclasses.replace(mine, body=person(1.1))
    assert contradictions(taller, reference) == () == signs_of_another_recording(taller, reference)
    other_seed = facts(reference, seed=2)
    signs = contradictions(facts(taller, seed=1), other_seed)
    assert len(signs) == 1 and "the bodies differ (joints by up to" in signs[0]
    assert contradictions(facts(mine, seed=1), other_seed) == ()
    headless = reference.body_xml.replace('name="Head"', 'name="Skull"')
    signs = contradictions(facts(mine, seed=1), dataclasses.replace(other_seed, body_xml=headless))
    assert signs == ("the bodies differ (segments Head, Skull on one side only)",)

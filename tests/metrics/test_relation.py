"""Solutions of another recording are recognised; those of the same one are not suspected."""

import dataclasses

import numpy as np
from small_person import person, recording, solution, swing

from mocap_jax.metrics.relation import signs_of_another_recording
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

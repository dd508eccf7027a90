# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Where should the sensors go?
#
# Given a body, some motions and a kind of sensor, `mj.place` chooses the segments and the places on
# them from the information matrix of the whole sequence: the same normal equations that
# `mj.optimise` solves, at the true motion, with the same priors and error model. No recording is
# needed.

# %%
import dataclasses

import matplotlib.pyplot as plt
import numpy as np

import mocap_jax as mj
from mocap_jax.placement import Constraints, Judge, SearchOptions
from mocap_jax.report import placement_figure
from mocap_jax.simulation import Suit, default_suit

mj.enable_compilation_cache()

# %% [markdown]
# ## The question
#
# Three boards with accelerometer and gyroscope, for two seconds of a routine. Small figures keep
# this notebook quick: a real study takes longer motions, more sensors and more evaluations.

# %%
body = mj.human()
routine = mj.builtin_motion("routine", body)
path = routine.trajectory
kept = (np.asarray(path.time) >= 5.0) & (np.asarray(path.time) <= 7.0)
clip = dataclasses.replace(
    routine,
    trajectory=dataclasses.replace(path, time=path.time[kept] - 5.0, q=path.q[kept], v=None),
)
options = mj.PlacementOptions(
    sensors=3,
    most=3,
    rate_hz=12.0,
    constraints=Constraints(symmetric=True),
    search=SearchOptions(restarts=1, steps=3, evaluations=25, ranked=3),
)
study = mj.place(body, [clip], options)
for rank, placement in enumerate(study.placements, start=1):
    print(f"{rank}. {placement.mean_cm:.2f} cm expected: {', '.join(placement.segments)}")
print(study.certificate.sentence)

# %% [markdown]
# ## The answer, drawn
#
# The body with its sensors (hollow: on the far side), what more sensors would buy, and which joints
# remain uncertain.

# %%
placement_figure(study)

# %% [markdown]
# ## Any other placement
#
# `Judge` tells what a suit of your own would achieve, here the boards of the standard suit on
# pelvis and forearms.

# %%
judge = Judge(body, [clip], options)
hands = ("pelvis", "left_forearm", "right_forearm")
own = Suit(tuple(b for b in default_suit(body).boards if b.name in hands))
print(
    f"chosen {study.best.mean_cm:.2f} cm, {', '.join(hands)}: {judge.evaluate(own).rms_cm:.2f} cm"
)

# %%
joints = judge.criterion.scenes[0].joints
figure, axis = plt.subplots(figsize=(9, 3), layout="constrained")
axis.bar(joints, 100 * np.sqrt(judge.evaluate(own).variance[0]), alpha=0.6, label="own")
axis.step(joints, list(study.best.expected_cm.values()), where="mid", color="k", label="chosen")
axis.tick_params(axis="x", rotation=90)
axis.set(ylabel="expected error [cm]")
axis.legend()
plt.show()

# %% [markdown]
# `mocap_jax.placement.write_placement` writes the suit as TOML and the body with the sensors as
# MJCF; `mj.simulate(clip, suit=study.best.suit)` records it. On the command line:
# `mocap-jax place routine:4-9 walking:2-7 -n 6 -o placement --symmetric`.

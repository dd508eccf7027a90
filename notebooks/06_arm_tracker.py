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
# # An arm from four ranges
#
# One ultrasonic mobile on the wrist, four anchors in the room: from times of flight to wrist,
# shoulder and elbow. First the paper's way (an unscented Kalman filter on the wrist's position,
# then inverse kinematics), then the general filter on joint angles and the whole-sequence optimiser
# on the very same ranges. `docs/arm_tracker.md` has the numbers of two-minute trials.

# %%
import matplotlib.pyplot as plt
import numpy as np

import mocap_jax as mj
from mocap_jax.arm import (
    anchor_ranges,
    joint_filter,
    optimised,
    paper_tracker,
    reference_angles,
    spatial_arm,
)
from mocap_jax.arm.errors import ROWS, true_points
from mocap_jax.simulation.arm import ArmScene, declared, simulate_arm
from mocap_jax.simulation.arm_movement import ArmMovement

mj.enable_compilation_cache()

# %% [markdown]
# ## The trial
#
# Six seconds of flexion and extension by C MuJoCo. The arm also moves out of its plane (4 degrees
# RMS) and the mobile vibrates on the wrist (2 mm RMS); the paper's filter knows of neither.

# %%
scene = ArmScene(movement=ArmMovement(seconds=6.0))
trial = simulate_arm(scene, seed=0)
ranges = anchor_ranges(trial)
figure, axis = plt.subplots(figsize=(9, 3), layout="constrained")
for name, distance in zip(ranges.names, ranges.distance.T, strict=True):
    axis.plot(ranges.time, distance, label=name)
axis.set(xlabel="time [s]", ylabel="range [m]")
axis.legend(ncols=4)
plt.show()

# %% [markdown]
# ## Three trackers
#
# The same ranges, with two declarations of the arm: planar for the paper's filter; a shoulder that
# also abducts and turns, by less than 15 degrees, for ours.

# %%
sagittal = declared(trial, scene, "sagittal")
smoothed = joint_filter(sagittal, smooth=True)
tracks = {
    "paper's UKF": paper_tracker(trial),
    "joint UKF": joint_filter(sagittal),
    "optimiser": optimised(sagittal, robust=False, initial=smoothed),
}
print(f"{'|mean| +- std':18s}" + "".join(f"{name:>18s}" for name in tracks))
errors = {name: track.errors(trial) for name, track in tracks.items()}
for i, row in enumerate(ROWS):
    cells = (f"{abs(e.mean[i]):.2f} +- {e.std[i]:.2f}" for e in errors.values())
    print(f"{row:18s}" + "".join(f"{cell:>18s}" for cell in cells))
for name, track in tracks.items():
    for remark in track.remarks:
        print(f"{name}: {remark}")

# %%
time = np.asarray(trial.truth.trajectory.time)
true = np.rad2deg(reference_angles(true_points(trial)))
figure, axes = plt.subplots(2, 1, figsize=(9, 5), sharex=True, layout="constrained")
for axis, column, label in zip(axes, (0, 1), ("shoulder [deg]", "elbow [deg]"), strict=True):
    axis.plot(time, true[:, column], "k", lw=2, label="truth")
    for name, track in tracks.items():
        axis.plot(track.time, np.rad2deg(track.angles[:, column]), lw=1, label=name)
    axis.set_ylabel(label)
axes[1].set_xlabel("time [s]")
axes[0].legend(ncols=4)
plt.show()

# %% [markdown]
# Near full extension the wrist hardly moves when the elbow does: a millimetre of range is worth
# degrees there, and the inverse kinematics clamps the elbow where the wrist seems out of reach. The
# joint-angle trackers bridge those moments by what joints do.

# %% [markdown]
# ## What one wrist position cannot tell
#
# With a ball joint at the shoulder the arm may swivel about the line from shoulder to wrist. The
# inverse kinematics says so, and how large the circle is on which the elbow lies.

# %%
wrist = true_points(trial).wrist - np.array(scene.shoulder)
found = spatial_arm(wrist, (scene.upper_arm, scene.forearm))
print(found.undetermined)

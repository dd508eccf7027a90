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
# # Quick start: recording in, motion out
#
# A recording of 18 body-worn boards (accelerometer, gyroscope, ultrasonic distances) becomes the
# motion of an articulated body: first by an extended Kalman filter, then by a least-squares solve
# over the whole sequence. The recording is simulated, so it holds its own truth.

# %%
from importlib.resources import as_file, files

import jax
import matplotlib.pyplot as plt
import numpy as np

import mocap_jax as mj

mj.enable_compilation_cache()

# %% [markdown]
# ## The recording
#
# `mj.read_recording` reads any recording; here the one that comes with the package. A motion of
# your own becomes one with `mj.simulate(mj.load_motion("walk.amc"), profile="field")`.

# %%
with as_file(files("mocap_jax") / "data" / "demo.mcap") as path:
    recording = mj.read_recording(path)
start, end = recording.interval
print(f"{end - start:.1f} s, {len(recording.inertial)} boards: {', '.join(recording.inertial)}")

# %% [markdown]
# What one board measures: specific force (gravity included, so +9.81 along "up" at rest) and
# angular velocity, both in the sensor's own frame.

# %%
board = recording.inertial["right_forearm"]
figure, axes = plt.subplots(2, 1, figsize=(9, 5), sharex=True, layout="constrained")
axes[0].plot(board.time, board.accelerometer)
axes[0].set(ylabel="specific force [m/s²]", title="right forearm")
axes[1].plot(board.time, board.gyroscope)
axes[1].set(ylabel="angular velocity [rad/s]", xlabel="time [s]")
axes[1].legend(["x", "y", "z"], ncols=3)
plt.show()

# %% [markdown]
# ## The filter
#
# The body and the places of the sensors come with the recording; `mj.load_body` reads another.
# `options=mj.EkfOptions(smooth=True)` would run the backward smoother as well.

# %%
filtered = mj.ekf(recording)
print(filtered.status.value)

# %% [markdown]
# ## The whole sequence at once
#
# All poses, sensor biases and mounting rotations are unknowns of one problem. The status is a value
# with a sentence, not an exception.

# %%
solution = mj.optimise(recording, initial=filtered)
print(solution.status.value, *solution.remarks, sep="\n")

# %%
figure, axis = plt.subplots(figsize=(6, 3), layout="constrained")
axis.semilogy(solution.cost, marker="o")
axis.set(xlabel="iteration", ylabel="cost", title="Half the sum of squared whitened residuals")
plt.show()

# %% [markdown]
# ## Errors against the truth

# %%
estimates = {"filter": filtered, "whole sequence": solution}
tables = {name: mj.evaluate(estimate, recording) for name, estimate in estimates.items()}
for name, table in tables.items():
    mean = table["orientation_error_mean_deg"]["mean_observed"]
    print(f"{name:16s} joint orientation error {mean:6.2f} deg (mean over observed joints)")

# %% [markdown]
# ## Poses, angles, uncertainty
#
# `solution.to_dataframe()` has one row a frame; `solution.to_xarray()` carries units as well.
# Everything below is JAX: the trajectory is an array, the body a pytree, kinematics can be mapped
# and differentiated.

# %%
angles = solution.to_dataframe()
print(angles.iloc[:3, :8])

# %%
body = solution.body
hand = body.site_index("right_hand")
path_of_hand = jax.jit(jax.vmap(lambda q: mj.site_frames(body, q).position[hand]))
position = np.asarray(path_of_hand(solution.trajectory.q))
figure, axis = plt.subplots(figsize=(9, 3), layout="constrained")
axis.plot(solution.trajectory.time, position)
axis.set(xlabel="time [s]", ylabel="right hand [m]")
axis.legend(["x", "y", "z"], ncols=3)
plt.show()

# %%
if solution.covariance is not None:
    sigma = np.rad2deg(np.sqrt(np.diagonal(np.asarray(solution.covariance), axis1=1, axis2=2)))
    print(f"median standard deviation of the joint angles {np.median(sigma[:, 6:]):.2f} deg")

# %% [markdown]
# `mj.write_solution("walk.solution.mcap", solution)` keeps it all;
# `mj.export_motion("walk.bvh", solution)` takes the motion to other programs.

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
# # Refining a filter's result
#
# An extended Kalman filter looks at each frame once, with what came before. Its backward smoother
# adds what came after, but keeps the filter's sensor calibration. The whole-sequence solve takes
# either as its start and moves all poses **and** all sensor constants (gyroscope and accelerometer
# biases, mounting rotations and positions) until they explain all measurements together.
#
# This notebook refines one such result, and looks at what that bought: in error, in uncertainty
# and in calibration. The recording is simulated, so its truth is known.

# %%
import dataclasses
import tempfile
from pathlib import Path

import jax
import matplotlib.pyplot as plt
import numpy as np

import mocap_jax as mj
from mocap_jax.metrics import interpolate, joint_consistency

mj.enable_compilation_cache()

# %% [markdown]
# ## A recording
#
# Four seconds of motion after a rest hold, in the `field` profile: 18 boards with bias and scale
# errors, mounted some 3 degrees askew, on soft tissue, on a person whose segments are not quite as
# long as the body model says. None of this is told to the estimators.


# %%
def cut(motion, seconds):
    """The first seconds of a motion."""
    path = motion.trajectory
    keep = int(np.sum(path.time <= seconds))
    shorter = dataclasses.replace(path, time=path.time[:keep], q=path.q[:keep])
    return dataclasses.replace(motion, trajectory=shorter)


motion = cut(mj.builtin_motion("routine"), 4.0)
recording = mj.simulate(motion, profile="field", seed=0)
print(f"{recording.interval[1] - recording.interval[0]:.1f} s, {len(recording.inertial)} boards")

# %% [markdown]
# ## Filter and smoother

# %%
filtered = mj.ekf(recording)
smoothed = mj.ekf(recording, options=mj.EkfOptions(smooth=True))
print(filtered.status.value, smoothed.status.value, sep="\n")

# %% [markdown]
# ## Refine, from a file
#
# A solution file holds the poses, their covariances, the sensor constants and the body: all that a
# later refinement starts from. The recording is needed again, for its measurements.

# %%
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "ekf.solution.mcap"
    mj.write_solution(file, filtered)
    initial = mj.read_solution(file)

refined = mj.optimise(recording, initial=initial)
print(refined.status.value, *refined.remarks, sep="\n")
print(f"{refined.iterations} iterations, {refined.seconds_solve:.0f} s")

# %% [markdown]
# ## Cost per iteration
#
# The cost is half the sum of squared residuals, each in units of its expected deviation. Between
# rounds the solver re-estimates how good each sensor really is, which rescales the residuals:
# there the cost jumps, and only its fall within a round tells of progress.

# %%
figure, axis = plt.subplots(figsize=(7, 3), layout="constrained")
axis.semilogy(np.arange(1, len(refined.cost) + 1), refined.cost, marker=".")
axis.set(xlabel="iteration", ylabel="cost [1]", title="Whole-sequence solve, started from the EKF")
plt.show()

# %% [markdown]
# ## Error over time
#
# The error of a joint is the angle between its estimated and true rotation. The mean is over the
# joints that the sensors observe: those with a board on both sides.

# %%
estimates = {"EKF": filtered, "smoothed": smoothed, "refined": refined}
truth = recording.truth.trajectory
true_body = mj.load_body(recording.truth.body_xml)
body = filtered.body
topology = body.topology
dofs = {
    name: [d for j in topology.joints_of_body(topology.body_index(name))
           for d in np.flatnonzero(topology.dof_joint == j)]
    for name in refined.observed
}  # fmt: skip


@jax.jit
@jax.vmap
def tangent(q, q_true):
    """Tangent vector from the estimate to the truth: rotation vectors and hinge angles."""
    return mj.difference(topology, q, q_true)


def joint_errors(solution):
    """Error [deg] of every observed joint over time, (t, joints)."""
    q_true = interpolate(true_body, truth, solution.trajectory.time)
    delta = np.asarray(tangent(solution.trajectory.q, q_true))
    return np.rad2deg(np.stack([np.linalg.norm(delta[:, d], axis=1) for d in dofs.values()], 1))


time = np.asarray(filtered.trajectory.time)
errors = {name: joint_errors(s) for name, s in estimates.items()}
figure, axis = plt.subplots(figsize=(9, 3), layout="constrained")
for name, error in errors.items():
    axis.plot(time, error.mean(axis=1), label=name)
axis.axvspan(0, recording.setup.score_from, color="0.93")
axis.text(0.1, 0.2, "rest hold and blend (not scored)", color="0.4", size=8)
axis.set(xlabel="time [s]", ylabel="joint error [deg]", ylim=(0, None))
axis.legend(ncols=3)
plt.show()

# %% [markdown]
# ## Joint by joint

# %%
tables = {name: mj.evaluate(s, recording) for name, s in estimates.items()}
by_joint = tables["EKF"].to_dataframe()[[]]
for name, table in tables.items():
    by_joint[name] = table.to_dataframe()["orientation_error_mean_deg"]
print(by_joint.loc[[*refined.observed, "mean_observed", "mean"]].round(2).to_string())

# %% [markdown]
# ## Uncertainty before and after
#
# Every solution states the covariance of its poses. Joint by joint: the error (bars) beside what
# the solution itself expected (marks). The filter takes its calibration for nearly exact, so it
# promises more than it holds. The refinement treats calibration as unknown and states a larger
# uncertainty;
# in the `field` profile, whose errors are no white noise, it is still too small.

# %%
scored = time >= recording.setup.score_from
place = np.arange(len(dofs))
figure, axis = plt.subplots(figsize=(9, 3.6), layout="constrained")
for i, (name, solution) in enumerate(estimates.items()):
    variance = np.diagonal(np.asarray(solution.covariance), axis1=1, axis2=2)[scored]
    expected = [np.sqrt(variance[:, d].sum(axis=1).mean()) for d in dofs.values()]
    rms = np.sqrt((errors[name][scored] ** 2).mean(axis=0))
    axis.bar(place + 0.27 * (i - 1), rms, 0.25, label=f"{name}: RMS error")
    axis.plot(place + 0.27 * (i - 1), np.rad2deg(expected), "k_", ms=8,
              label="stated" if i == 0 else None)  # fmt: skip
axis.set_xticks(place, list(dofs), rotation=40, ha="right")
axis.set(ylabel="[deg]")
axis.legend(ncols=2)
plt.show()

for name, solution in estimates.items():
    found = joint_consistency(solution, recording)
    print(f"{name:9s} RMS error {np.rad2deg(found.rms):5.2f} deg, stated "
          f"{np.rad2deg(found.predicted_rms):5.2f} deg; {100 * found.coverage:3.0f} % of the "
          "components lie inside their 95 % interval")  # fmt: skip

# %% [markdown]
# ## What the refinement changed
#
# The filter's sensor constants come from the rest hold alone. There a board that is mounted askew
# and a joint that is not quite in the declared pose look the same. Only motion tells them apart,
# and a few seconds of it need not suffice for every board: look for points far from the line, and
# for the joints of those boards in the table above.

# %%
rows = (
    ("mounting_rotation", "mounting rotation [deg]", 180 / np.pi),
    ("gyroscope_bias", "gyroscope bias [deg/s]", 180 / np.pi),
    ("accelerometer_bias", "accelerometer bias [m/s²]", 1.0),
)
figure, axes = plt.subplots(1, 3, figsize=(10, 3.4), layout="constrained")
for axis, (key, label, unit) in zip(axes, rows, strict=True):
    names = [f"{key}/{board}" for board in recording.inertial]
    true = unit * np.concatenate([np.asarray(recording.truth.parameters[n]) for n in names])
    for name, solution in (("EKF (rest hold)", filtered), ("refined", refined)):
        value = unit * np.concatenate([np.asarray(solution.calibration[n]) for n in names])
        axis.plot(true, value, ".", label=name, alpha=0.8)
        rms = np.sqrt(np.mean((value - true) ** 2))
        print(f"{label:28s} {name:16s} RMS error {rms:.3f}")
    axis.axline((0, 0), slope=1, color="0.6", linewidth=1, zorder=0)
    axis.set(xlabel="true", ylabel="found", title=label)
axes[0].legend()
plt.show()

# %% [markdown]
# ## Many results
#
# Recordings of the same body, suit and length share their compiled programs: only the first one
# waits for the compiler. A loop is all it takes.

# %%
print("seed  EKF [deg]  refined [deg]  solving [s]  compiling [s]")
for seed in (1, 2):
    another = mj.simulate(motion, profile="field", seed=seed)
    start = mj.ekf(another)
    better = mj.optimise(another, initial=start)
    before, after = (
        mj.evaluate(s, another)["orientation_error_mean_deg"]["mean_observed"]
        for s in (start, better)
    )
    print(f"{seed:4d} {before:10.2f} {after:14.2f} {better.seconds_solve:12.1f} "
          f"{better.seconds_compile:14.1f}")  # fmt: skip

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
# # How sure is it, and what else did it find out?
#
# A whole-sequence solve returns more than poses: the covariance of every pose, and estimates of
# what is wrong with the sensors and the body model, each with its own uncertainty. This notebook
# draws both beside the truth, says what the recording cannot tell, and ends with derivatives: how
# a result changes with a noise figure.

# %%
import dataclasses

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import optax

import mocap_jax as mj
from mocap_jax import so3
from mocap_jax.simulation import Mounting, Suit

mj.enable_compilation_cache()

# %% [markdown]
# ## Two recordings of one motion
#
# Five seconds of arms and legs after a rest hold. In the `paper` profile the sensors have white
# noise and nothing else. In the `field` profile boards are biased, mounted some 3 degrees askew and
# a centimetre off, on soft tissue, on a person whose segments differ by 3 % from the model, in air
# whose speed of sound is not quite as declared.
#
# By default the solver lowers the model errors of its options to what a recording shows. Five
# seconds show little: worn boards pass for clean ones, and what is stated is far too sure. Who
# knows that boards are worn on a body keeps the model errors with `adapt=False`.


# %%
def cut(motion, start, end):
    """Part of a motion, between two times [s]."""
    path = motion.trajectory
    keep = (np.asarray(path.time) >= start) & (np.asarray(path.time) <= end)
    part = dataclasses.replace(path, time=path.time[keep] - start, q=path.q[keep], v=None)
    return dataclasses.replace(motion, trajectory=part)


motion = cut(mj.builtin_motion("routine"), 15.0, 20.0)
recordings = {p: mj.simulate(motion, profile=p, seed=0) for p in ("paper", "field")}
options = {
    "paper": mj.OptimiseOptions(pair_covariance=True),
    "field": mj.OptimiseOptions(
        noise=mj.NoiseOptions(adapt=False), constants=mj.ConstantsOptions(adapt=False)
    ),
}
solutions = {p: mj.optimise(r, options=options[p]) for p, r in recordings.items()}
for profile, solution in solutions.items():
    print(f"{profile}: {solution.status.value}")

# %% [markdown]
# ## Bands
#
# `mj.uncertainty` turns the covariance of the poses into standard deviations of what people read:
# joint angles, positions of segments, velocities. Two of them to either side of the estimate should
# hold the truth nineteen times out of twenty.


# %%
def true_table(recording, solution):
    """Joint angles and poses of the truth, at the times of the solution."""
    path, body = recording.truth.trajectory, mj.load_body(recording.truth.body_xml)
    truth = dataclasses.replace(
        solution, trajectory=path, body=body, covariance=None, pair_covariance=None
    )
    return truth.to_xarray().interp(time=np.asarray(solution.trajectory.time))


def band(axis, time, value, std, true):
    """An estimate, two standard deviations to either side, and the truth."""
    axis.fill_between(time, value - 2 * std, value + 2 * std, alpha=0.3, lw=0, label="2 std")
    axis.plot(time, value, lw=1, label="estimate")
    axis.plot(time, true, "k--", lw=1, label="truth")


tables = {p: mj.uncertainty(s) for p, s in solutions.items()}
truths = {p: true_table(recordings[p], s) for p, s in solutions.items()}
time = np.asarray(solutions["paper"].trajectory.time)
name = "RightForeArm/flexion"
figure, axes = plt.subplots(2, 2, figsize=(10, 5), sharex=True, layout="constrained")
for column, (profile, solution) in zip(axes.T, solutions.items(), strict=True):
    angle = np.rad2deg(solution.to_xarray().joint_angle.sel(angle=name))
    std = np.rad2deg(tables[profile].joint_angle_std.sel(angle=name))
    true = np.rad2deg(truths[profile].joint_angle.sel(angle=name))
    band(column[0], time, angle, std, true)
    column[0].set(title=profile)
    band(column[1], time, 0 * angle, std, true - angle)
    column[1].set(xlabel="time [s]")
axes[0, 0].set(ylabel="right elbow flexion [deg]")
axes[1, 0].set(ylabel="less the estimate [deg]")
axes[0, 0].legend(fontsize=8)
plt.show()

# %% [markdown]
# The position of the right hand relative to the pelvis. Its band follows from the pose alone: in
# `field`, segments are also of another length than the model says, and that is not in it.


# %%
def in_root(table, segment, root="Pelvis"):
    """Position [m] of a segment in the frame of the root segment, (t, 3)."""
    R_world_root = np.asarray(table.segment_rotation.sel(segment=root))
    position = table.segment_position.sel(segment=segment) - table.segment_position.sel(
        segment=root
    )
    return np.einsum("tji,tj->ti", R_world_root, np.asarray(position))


figure, axes = plt.subplots(2, 3, figsize=(10, 4.5), sharex=True, layout="constrained")
for row, (profile, solution) in zip(axes, solutions.items(), strict=True):
    hand, true = (in_root(t, "RightHand") for t in (solution.to_xarray(), truths[profile]))
    std = np.asarray(tables[profile].segment_position_in_root_std.sel(segment="RightHand"))
    for i, axis in enumerate(row):
        band(axis, time, 0 * time, 1000 * std[:, i], 1000 * (true - hand)[:, i])
        axis.set(title=f"{profile}, {'xyz'[i]}")
    row[0].set(ylabel="hand less estimate [mm]")
for axis in axes[-1]:
    axis.set(xlabel="time [s]")
axes[0, 0].legend(fontsize=8)
plt.show()

# %% [markdown]
# ## Are the bands honest?
#
# Coverage is the share of errors inside their 95 % interval; the normalised squared error (NEES)
# has mean 1 where the covariance is right. White noise is what the solver assumes, so `paper` comes
# out right. Sensors on soft tissue err in step with the motion, which no white noise describes:
# with the model errors kept, intervals in `field` are rather too wide than too narrow.

# %%
print("profile   inside 95 %   RMS error / stated   NEES, median frame")
for profile, solution in solutions.items():
    found = mj.joint_consistency(solution, recordings[profile])
    nees = np.median(mj.nees(solution, recordings[profile]))
    print(f"{profile:9s} {100 * found.coverage:9.0f} % {found.ratio:17.2f} {nees:18.2f}")

# %% [markdown]
# ## Velocities
#
# Errors of neighbouring frames are nearly the same, and cancel in their difference. Only the
# covariance between frames knows by how much: `pair_covariance=True` keeps it. Taken for
# independent, the same two frames would give a band many times too wide.

# %%
table, truth = tables["paper"], truths["paper"]
rate = np.rad2deg(table.joint_angle_rate.sel(angle=name))
rate_std = np.rad2deg(table.joint_angle_rate_std.sel(angle=name))
true_rate = np.rad2deg(np.diff(truth.joint_angle.sel(angle=name))) / np.diff(time)
alone = np.rad2deg(np.asarray(table.joint_angle_std.sel(angle=name)))
independent = np.hypot(alone[1:], alone[:-1]) / np.diff(time)
figure, axes = plt.subplots(2, 1, figsize=(9, 4.5), sharex=True, layout="constrained")
middle = np.asarray(table.interval)
axes[0].plot(middle, rate, lw=1)
axes[0].set(ylabel="elbow [deg/s]")
band(axes[1], middle, 0 * rate, rate_std, true_rate - rate)
axes[1].set(xlabel="time [s]", ylabel="less the estimate [deg/s]")
axes[1].legend(fontsize=8, ncols=3)
plt.show()
print(f"stated {np.median(rate_std):.2f} deg/s; were frames independent "
      f"{np.median(independent):.0f} deg/s; actual error "
      f"{np.sqrt(np.mean((true_rate - rate) ** 2)):.2f} deg/s")  # fmt: skip

# %% [markdown]
# ## Self-calibration
#
# Biases, mountings, lengths and the speed of sound are unknowns beside the poses. The estimates of
# the `field` recording against what the simulator really did, with two standard deviations.

# %%
solution, true = solutions["field"], recordings["field"].truth.parameters
body, real = solution.body, mj.load_body(recordings["field"].truth.body_xml)
topology = body.topology


def true_constant(key):
    """What `Solution.calibration[key]` should be."""
    kind, _, of = key.partition("/")
    if kind == "mounting_offset":
        at = body.site_index(of)
        shift = real.site_pos[real.site_index(of)] - body.site_pos[at]
        return np.asarray(so3.quat_to_matrix(body.site_quat[at])).T @ np.asarray(shift)
    if kind == "segment_length":  # a joint moves with the length of the segment before it
        parent = topology.body_parent[topology.body_index(of)]
        return np.asarray(true[f"segment_scale/{topology.body_names[parent]}"]) - 1
    if kind == "speed_of_sound":
        return np.asarray(true["speed_of_sound"]) / solution.setup.speed_of_sound - 1
    return np.asarray(true[key])


kinds = (
    ("gyroscope_bias", "gyroscope bias [deg/s]", 180 / np.pi),
    ("accelerometer_bias", "accelerometer bias [m/s²]", 1.0),
    ("mounting_rotation", "mounting rotation [deg]", 180 / np.pi),
    ("mounting_offset", "mounting position [mm]", 1000.0),
    ("segment_length", "segment length [%]", 100.0),
    ("source_offset", "offset of ranges [mm]", 1000.0),
)
figure, axes = plt.subplots(2, 3, figsize=(10, 6.5), layout="constrained")
for axis, (kind, label, unit) in zip(axes.flat, kinds, strict=True):
    keys = [key for key in solution.calibration if key.startswith(f"{kind}/")]
    actual, value, std = (
        unit * np.concatenate([np.ravel(of(key)) for key in keys])
        for of in (true_constant, solution.calibration.get, solution.calibration_std.get)
    )
    axis.errorbar(actual, value, 2 * std, fmt=".", lw=0.8, ms=4)
    axis.axline((0, 0), slope=1, color="0.6", lw=1, zorder=0)
    axis.set(xlabel="true", ylabel="found, 2 std", title=label)
    within = np.mean(np.abs(value - actual) < 2 * std)
    before, after = np.sqrt(np.mean(actual**2)), np.sqrt(np.mean((value - actual) ** 2))
    print(f"{label:27s} RMS before {before:6.3f}, left {after:6.3f}; "
          f"{100 * within:3.0f} % of {len(value)} within 2 std")  # fmt: skip
plt.show()
key = "speed_of_sound/air"
value, std = (
    100 * float(np.ravel(of[key])[0]) for of in (solution.calibration, solution.calibration_std)
)
print(f"speed of sound: found {value:+.2f} % of the declared, std {std:.2f} %; true "
      f"{100 * float(true_constant(key)):+.2f} %")  # fmt: skip

# %% [markdown]
# ## What it cannot tell
#
# There is always an answer: where the recording says nothing, the prior stands. `mj.determination`
# compares the two.

# %%
print(mj.determination(solution))

# %% [markdown]
# The share of the prior's deviation that is left, by kind: at 1 nothing was learnt.

# %%
stated, prior = solution.calibration_std, solution.calibration_prior_std
groups = sorted({key.partition("/")[0] for key in stated})
shares = [
    np.concatenate([np.ravel(stated[k] / prior[k]) for k in stated if k.startswith(f"{g}/")])
    for g in groups
]
figure, axis = plt.subplots(figsize=(9, 3), layout="constrained")
for i, share in enumerate(shares):
    axis.plot(i + np.linspace(-0.2, 0.2, len(share)), np.sort(share), ".", ms=4)
axis.axhline(1, color="0.6", lw=1)
axis.set_xticks(range(len(groups)), [g.replace("_", "\n", 1) for g in groups], fontsize=8)
axis.set(ylabel="deviation / prior's", ylim=(0, 1.1))
plt.show()

# %% [markdown]
# ## Derivatives
#
# `mj.differentiable` returns the estimate as a function of readings, noise figures, weights, body
# and mountings, which JAX differentiates: implicitly, at the minimum. Here for an arm of two
# segments with three boards, one of which is worse than its set-up says: the accelerometer on the
# forearm has thirty times the declared noise.

# %%
ARM = """<mujoco><worldbody><body name="Pelvis" pos="0 0 1"><freejoint/><geom size=".1"/>
<body name="UpperArm" pos="0 .2 .4"><joint name="shoulder" type="ball"/><geom size=".1"/>
<body name="ForeArm" pos="0 .3 0"><joint name="elbow" axis="0 0 1"/><geom size=".1"/></body></body>
</body></worldbody></mujoco>"""
arm = mj.load_body(ARM)
suit = Suit(
    (
        Mounting("back", "Pelvis", (0.1, 0.0, 0.0)),
        Mounting("upper", "UpperArm", (0.03, 0.15, 0.0)),
        Mounting("fore", "ForeArm", (0.0, 0.2, 0.02)),
    )
)
seconds = np.arange(0, 2.5, 1 / 100)
swing = np.random.default_rng(0).uniform(0.3, 0.8, arm.nv) * (np.arange(arm.nv) >= 3)
turns = swing * np.sin(2 * np.pi * np.outer(seconds, np.linspace(0.5, 1.2, arm.nv)))
poses = jax.vmap(lambda d: mj.retract(arm.topology, arm.qpos0, d))(jnp.asarray(turns))
swinging = mj.Motion("swinging arm", arm, mj.Trajectory(seconds, poses, None))
recorded = mj.simulate(
    swinging,
    suit=suit,
    options=mj.SimulationOptions(rest_s=1.0, blend_s=0.5, inertial_rate_hz=60.0),
)
board = recorded.inertial["fore"]
rough = 30 * recorded.setup.noise.accelerometer
noise = rough * np.random.default_rng(1).normal(size=board.accelerometer.shape)
worse = dataclasses.replace(board, accelerometer=board.accelerometer + noise)
recorded = dataclasses.replace(recorded, inertial=recorded.inertial | {"fore": worse})
taken_at_its_word = mj.OptimiseOptions(
    kinds="AG",
    noise=mj.NoiseOptions(model_errors=False, adapt=False, inertial_loss="none"),
    constants=mj.ConstantsOptions(adapt=False),
)
estimate = mj.differentiable(recorded, options=taken_at_its_word)

# %%
path = recorded.truth.trajectory
found_at = np.asarray(estimate.solution.trajectory.time)
true_q = np.asarray(path.q)[np.searchsorted(path.time, found_at - 1e-6)]
scored_frames = found_at >= recorded.setup.score_from


def squared_error(p):
    """Mean squared error of the joints and the root's turn [deg²]."""
    body = estimate.solution.body
    error = jax.vmap(lambda a, b: mj.difference(body.topology, a, b))(estimate(p).q, true_q)
    return jnp.mean(jnp.rad2deg(error[scored_frames, 3:]) ** 2)


value, slopes = jax.value_and_grad(squared_error)(estimate.parameters)
print(f"RMS error {np.sqrt(value):.3f} deg. Change of its square [deg²] per doubling of")
for name in ("gyroscope", "accelerometer", "root_orientation", "smoothness_density"):
    now = getattr(estimate.parameters.figures, name)
    print(f"{name + ' (figure)':30s} {np.log(2) * now * getattr(slopes.figures, name):+.1e}")
for sensor, slope in zip(estimate.sensors, slopes.weights.accelerometer, strict=True):
    print(f"{'weight of accelerometer ' + sensor:30s} {np.log(2) * slope:+.1e}")

# %% [markdown]
# One board's accelerometer does harm. The same pass gives the derivative by every reading: which
# moments of which gyroscope the result hangs on (those of the rest hold tell the biases).

# %%
influence = np.linalg.norm(slopes.measurements.gyroscope, axis=-1)
figure, axis = plt.subplots(figsize=(9, 2.8), layout="constrained")
axis.plot(found_at, influence, lw=1)
axis.set(
    xlabel="time [s]", ylabel="[deg² / (rad/s)]", title="Influence of the gyroscopes' readings"
)
axis.legend(estimate.sensors, fontsize=8)
plt.show()

# %% [markdown]
# A few steps down the slope by the accelerometers' weights, with optax: a recording whose truth is
# known tunes weights for recordings whose truth is not.


# %%
def with_weights(log_weights):
    """The parameters with other weights of the accelerometers."""
    p = estimate.parameters
    weights = dataclasses.replace(p.weights, accelerometer=jnp.exp(log_weights))
    return dataclasses.replace(p, weights=weights)


descent, log_weights = optax.adam(0.8), jnp.zeros(3)
state, history = descent.init(log_weights), []
for _ in range(12):
    value, slope = jax.value_and_grad(lambda x: squared_error(with_weights(x)))(log_weights)
    history.append((*np.exp(log_weights), np.sqrt(value)))
    change, state = descent.update(slope, state)
    log_weights = optax.apply_updates(log_weights, change)
history = np.array(history)
figure, axes = plt.subplots(1, 2, figsize=(9, 3), layout="constrained")
axes[0].plot(history[:, 3], marker=".")
axes[0].set(xlabel="step", ylabel="RMS error [deg]", ylim=(0, None))
axes[1].semilogy(history[:, :3], marker=".", label=estimate.sensors)
axes[1].axhline(1 / 30**2, color="0.6", lw=1, zorder=0)
axes[1].set(xlabel="step", ylabel="weight of accelerometer")
axes[1].legend(fontsize=8)
plt.show()

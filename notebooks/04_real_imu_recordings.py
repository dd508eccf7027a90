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
# # Real recordings of inertial sensors
#
# Two public recordings, from files of other systems to joint angles: OpenSense's walk (eight
# sensors that report orientations, an OpenSim model) and the full-body example of the qmt toolbox
# (sixteen sensors, accelerations and rates only, no magnetometer, no reference). They are read from
# the folder `MOCAP_JAX_DATA`.

# %%
import os
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import mocap_jax as mj
from mocap_jax.report.strip import motion_strip

mj.enable_compilation_cache()
data = Path(os.environ.get("MOCAP_JAX_DATA", "../shared/data"))

# %% [markdown]
# ## OpenSense: orientations and an OpenSim model
#
# `mj.convert` finds out the format, the mapping says which sensor is worn where. Units, quaternions
# and frames become ours, and readings are checked against each other.

# %%
folder = data / "opensense_walking"
walk = mj.convert(folder / "IMUData", mapping=folder / "myIMUMappings.xml")
model = mj.load_body(folder / "Rajagopal_2015.osim")
start, end = walk.interval
print(f"{end - start:.1f} s: {', '.join(walk.inertial)}")

# %% [markdown]
# Nobody knows how the sensors sit on their segments: a still second in a known pose tells. The
# wearer stands in the model's default pose at the start. `mj.calibrate_mounting` takes each
# sensor's tilt from gravity then, and where the body faces from the axes about which the knees
# bend; the table says what was found for each sensor, how sure it is, and how well the body fits
# the orientations of the whole walk.

# %%
segments = {name: name.removesuffix("_imu") for name in walk.inertial}
worn = mj.calibrate_mounting(walk, model, segments)
print(worn)

# %% [markdown]
# Frame by frame from orientations, as OpenSim's inverse kinematics; `mj.export_motion("walk.mot",
# angles)` writes it for OpenSim.

# %%
angles = mj.orientation_pass(mj.cut(worn.recording, 8.0, 11.0), worn.body, start=worn.pose)
table = angles.to_dataframe()
figure, axes = plt.subplots(1, 2, figsize=(9, 3), sharey=True, layout="constrained")
for axis, side, word in zip(axes, "rl", ("right", "left"), strict=True):
    for segment, name in (("femur", "hip"), ("tibia", "knee"), ("talus", "ankle")):
        column = next(c for c in table.columns if c.startswith(f"{segment}_{side}/"))
        axis.plot(table.index, np.rad2deg(table[column]), label=column.split("/")[1] + f", {name}")
    axis.set(title=word, xlabel="time [s]")
    axis.legend(fontsize=8)
axes[0].set(ylabel="joint angle [deg]")
plt.show()

# %% [markdown]
# The model has no head, and its trunk is drawn as two lines to the shoulders. No sensor is worn on
# the arms: they keep the pose that they had at rest.

# %%
motion_strip(angles, poses=10)

# %% [markdown]
# ## qmt: accelerations and rates only
#
# Sixteen sensors, a preset of the converter. Orientations come from VQF, each sensor for itself;
# without a magnetometer every heading starts anywhere. The wearer stands still for four seconds,
# then walks to a chair with the hands at the head and sits down.

# %%
raw = mj.convert(
    data / "qmt_full_body_16imu" / "full_body_example_data.mat",
    mapping="qmt_full_body",
    options=mj.ConvertOptions(orientation="vqf"),
)
part = mj.cut(raw, 0.0, 14.0)
print(f"heading: {raw.setup.provenance['heading']}")

# %% [markdown]
# Two neighbouring sensors feel the acceleration of the joint between them, which only fits if
# their headings do. The more motion, the surer; here all 100 s are used.

# %%
suit = mj.calibrate_mounting(raw, mj.human(1.75))
print(suit)

# %%
headings = [s for s in suit.sensors if s.joint is not None]
figure, axis = plt.subplots(figsize=(9, 3), layout="constrained")
axis.errorbar(
    [s.sensor for s in headings],
    [np.rad2deg(s.joint.angle) for s in headings],
    [np.rad2deg(s.joint.std) for s in headings],
    fmt="o",
)
axis.set(ylabel="heading against the\nnext sensor [deg]", title="found from the joints")
axis.tick_params(axis="x", rotation=60)
plt.show()

# %% [markdown]
# The whole sequence at once, from accelerations and rates, feet that stand held to the ground. The
# orientations of VQF only make the start.

# %%
recording = mj.cut(suit.recording, *part.interval)
frames = mj.OrientationPassOptions(rate_hz=25.0)
first = mj.orientation_pass(recording, suit.body, start=suit.pose, options=frames)
options = mj.OptimiseOptions(
    kinds="AG",
    root="free",
    rate_hz=25.0,
    covariance=False,
    constants=mj.ConstantsOptions(offset_sigma=0.05, mounting_sigma=0.1),
    contacts=mj.ContactOptions(),
)
motion = mj.optimise(recording, suit.body, initial=first, options=options)
print(motion.status.value)

# %%
motion_strip(motion, poses=14, width=14)

# %%
table = motion.to_dataframe()
figure, axis = plt.subplots(figsize=(9, 3), layout="constrained")
for column in ("RightLowerLeg/flexion", "LeftLowerLeg/flexion", "RightForeArm/flexion"):
    axis.plot(table.index, np.rad2deg(table[column]), label=column)
axis.set(xlabel="time [s]", ylabel="joint angle [deg]")
axis.legend(fontsize=8)
plt.show()

# %% [markdown]
# There is no reference for this recording. What can be checked without one (closure of headings,
# slip of standing feet, residuals of each sensor, angles against published ranges) is what
# `scripts/reproduce_qmt` prints: docs/full_body_imu.md.

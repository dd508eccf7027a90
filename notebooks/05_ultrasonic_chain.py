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
# # From a microphone's voltage to distances and readings
#
# Each sensor board of Vlasic 2007 sends one voltage to the driver box: its microphone's amplified
# signal and, on the same wire, the readings of gyroscopes and accelerometers as a bit stream. This
# notebook simulates such wires and follows them through decoding; its pictures are the paper's
# figures 3 to 5 from our data. `docs/raw.md` and `docs/telemetry.md` describe every step.

# %%
import dataclasses
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy import signal

import mocap_jax as mj
from mocap_jax.decoding import decode_raw
from mocap_jax.signals.telemetry.frame import BIT_RATE_HZ
from mocap_jax.signals.ultrasonic.arrivals import DetectorOptions
from mocap_jax.simulation.raw import RawOptions, simulate_raw

# %% [markdown]
# ## Wires
#
# Seven seconds of a motion that exercises every joint, in the `paper` profile: 18 boards, eight
# sources that emit a burst of ten cycles of 40 kHz in turn, every 8 ms. Sound reaches a microphone
# directly, around the body, and off floor, walls and limbs.


# %%
def cut(motion, start, end):
    """Part of a motion, between two times [s]."""
    path = motion.trajectory
    keep = (np.asarray(path.time) >= start) & (np.asarray(path.time) <= end)
    part = dataclasses.replace(path, time=path.time[keep] - start, q=path.q[keep], v=None)
    return dataclasses.replace(motion, trajectory=part)


levels = RawOptions()
raw = simulate_raw(
    cut(mj.builtin_motion("routine"), 10.0, 17.0), profile="paper", seed=0, raw=levels
)
print(f"{raw.duration:.1f} s, {len(raw.wires)} wires of {raw.sample_rate_hz / 1e3:.0f} kHz, "
      f"{len(raw.pulse_time)} pulses")  # fmt: skip

# %% [markdown]
# ## Figure 3: what a board sends
#
# Sound and bits, 40 ms of the board on the left hand, and the sum that the driver box samples. The
# pulses of near sources stand out; what follows them are reflections. The bits are weaker than near
# pulses, and lie below 13 kHz.

# %%
board = raw.wires.index("left_hand")
first, samples = next(iter(raw.chunks()))
window = slice(15_000, 21_000)
time = (first + np.arange(window.start, window.stop)) / raw.sample_rate_hz
wire = samples[board, window].astype(float)
bits = levels.telemetry * raw.boards[board].volts(first + window.start, len(wire))

figure, axes = plt.subplots(3, 1, figsize=(9, 5), sharex=True, layout="constrained")
for axis, values, title in zip(
    axes, (wire - bits, bits, wire),
    ("microphone, amplified", "telemetry: rates and accelerations as bits", "on the wire"),
    strict=True,
):  # fmt: skip
    axis.plot(1e3 * time, values, linewidth=0.6)
    axis.set(title=title, ylabel="[steps]")
emitted = raw.pulse_time[(raw.pulse_time >= time[0]) & (raw.pulse_time < time[-1])]
for t in emitted:
    axes[0].axvline(1e3 * t, color="C3", linewidth=0.8)
axes[0].text(1e3 * emitted[0], axes[0].get_ylim()[1], " emission", color="C3", va="top", size=8)
axes[-1].set(xlabel="time [ms]", xlim=1e3 * time[[0, -1]])
plt.show()

# %% [markdown]
# ## Figure 4, top: from sound to distance
#
# The published chain, written out for one slot: band-pass at 40 kHz +- 2.5 kHz, square, low-pass
# at 30 kHz, steepest rise of the power. It stands some time after the sound's arrival, always the
# same, which is calibrated.

# %%
band = signal.butter(2, (37_500.0, 42_500.0), "bandpass", fs=raw.sample_rate_hz, output="sos")
low = signal.butter(4, 30_000.0, fs=raw.sample_rate_hz, output="sos")
whole = samples[board].astype(float)
narrow = signal.sosfiltfilt(band, whole)
power = signal.sosfiltfilt(low, narrow**2)

pulse = int(np.searchsorted(raw.pulse_time, time[0]))
pulse += int(np.argmax(raw.visible[pulse : pulse + 8, board]))
source = raw.recording.setup.sources[raw.pulse_source[pulse]].removeprefix("source/")
emission = raw.pulse_time[pulse]
slot = slice(round(emission * raw.sample_rate_hz), round((emission + 0.008) * raw.sample_rate_hz))
since = (np.arange(slot.start, slot.stop) / raw.sample_rate_hz - emission) * 1e3
arrival = 1e3 * raw.distance[pulse, board] / raw.recording.setup.speed_of_sound
rise = np.argmax(np.diff(power[slot]))

figure, axes = plt.subplots(3, 1, figsize=(9, 5), sharex=True, layout="constrained")
axes[0].plot(since, whole[slot], linewidth=0.6)
axes[0].set_title(f"wire of the left hand, slot of the source {source}")
axes[1].plot(since, narrow[slot], linewidth=0.6)
axes[1].set_title("40 kHz ± 2.5 kHz")
axes[2].plot(since, power[slot])
axes[2].axvline(since[rise], color="C1", label="steepest rise")
axes[2].set(title="power", xlabel="time since emission [ms]", xlim=(0, 8))
for axis in axes:
    axis.axvline(arrival, color="C3", linestyle=":", label="true arrival")
axes[2].legend()
plt.show()

# %% [markdown]
# ## Figure 4, bottom: from bits to readings
#
# The same wire below 13 kHz, and what was sent: one bit every 78 µs, a frame of 92 bits for the six
# readings of a board, 140 times a second.

# %%
low = signal.butter(6, 10_000.0, fs=raw.sample_rate_hz, output="sos")
voltage = signal.sosfiltfilt(low, whole)[window]
part = slice(0, 450)
figure, axis = plt.subplots(figsize=(9, 2.4), layout="constrained")
axis.plot(1e3 * time[part], voltage[part], label="wire below 10 kHz")
axis.plot(1e3 * time[part], bits[part], "--", linewidth=0.9, label="sent")
sent = raw.boards[board]
phase = (time[part] - sent.start - 2 * sent.period) * (92 / sent.period) - 0.5
middle = np.array([part.start + np.argmin(np.abs(phase - k))
                   for k in range(int(np.ceil(phase[0])), int(phase[-1]) + 1)])  # fmt: skip
axis.plot(1e3 * time[middle], voltage[middle], ".", color="k", label="decided here")
axis.axhline(0, color="0.7", linewidth=0.8)
axis.set(xlabel="time [ms]", ylabel="[steps]", title=f"{BIT_RATE_HZ:.0f} bit/s")
axis.set_ylim(-1800, 1200)
axis.legend(ncols=3, loc="lower right")
plt.show()

# %% [markdown]
# ## The whole recording
#
# `mocap-jax decode` does this for all wires, in pieces. Frames that are beyond correction and
# pulses that are not heard are missing from its result; nothing is made up.

# %%
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "routine.raw.mcap"
    raw.write(file)
    size = file.stat().st_size
    decoded = {d: decode_raw(file, DetectorOptions(detector=d)) for d in ("matched", "inflection")}
best = decoded["matched"]
lost = sum(b.lost for b in best.boards.values())
print(f"{size / 1e6:.0f} MB; {best.heard} arrivals of {best.slots} slots; {lost} frames lost")

stream = best.recording.inertial["right_forearm"]
board = raw.boards[raw.wires.index("right_forearm")]
frame = np.rint((np.asarray(stream.time) - board.start) / board.period - 0.5).astype(int)
figure, axes = plt.subplots(2, 1, figsize=(9, 4), sharex=True, layout="constrained")
for axis, values, exact, label in (
    (axes[0], stream.gyroscope, board.exact[:, :3], "rate [rad/s]"),
    (axes[1], stream.accelerometer, board.exact[:, 3:], "specific force [m/s²]"),
):
    axis.plot(stream.time, values, linewidth=1)
    axis.plot(stream.time, exact[frame], "k:", linewidth=0.8)
    axis.set(ylabel=label)
    rms = np.sqrt(np.nanmean((np.asarray(values) - exact[frame]) ** 2))
    print(f"{label}: RMS error {rms:.4f}, with white noise, 12-bit levels and 6-bit steps")
axes[0].set_title("right forearm: decoded (lines) and true (dotted)")
axes[1].set(xlabel="time [s]")
plt.show()

# %% [markdown]
# ## Distances
#
# The inflection point is the paper's; the default is the peak of a filter matched to the burst.
# Both are compared with the true distances.


# %%
def compared(ranges):
    """Error [m], confidence and whether the pair was visible, of each decoded distance."""
    pulse = np.searchsorted(raw.pulse_time, np.asarray(ranges.time) - 1e-6)
    receiver = np.asarray(ranges.receiver)
    error = np.asarray(ranges.distance) - raw.distance[pulse, receiver]
    return error, np.asarray(ranges.confidence), raw.visible[pulse, receiver]


figure, axis = plt.subplots(figsize=(6, 3), layout="constrained")
for name, result in decoded.items():
    error, confidence, visible = compared(result.recording.ranges)
    trusted = confidence > 0.5
    wrong = np.abs(error[trusted]) > 0.01
    rms = np.sqrt(np.mean(error[trusted & visible] ** 2))
    print(f"{name:11s} {trusted.sum()} distances with confidence above 0.5, RMS error "
          f"{1e3 * rms:.2f} mm, {100 * wrong.mean():.2f} % wrong by more than 10 mm")  # fmt: skip
    axis.hist(1e3 * error[trusted], np.linspace(-10, 10, 81), histtype="step", label=name)
axis.set(xlabel="error [mm]", ylabel="distances", title="confidence above 0.5")
axis.legend()
plt.show()

# %% [markdown]
# ## Figure 5: confidences over time
#
# Belly and hat source at the boards of hand, thigh and foot. A pair out of sight is heard as a
# faint leak or as a reflection: too faint for its distance, or longer than the body allows. Either
# has a confidence near 0. What is visible but far has a lower one, since noise shifts faint sounds
# more: estimators divide the deviation of a distance by its confidence.

# %%
ranges = best.recording.ranges
figure, axes = plt.subplots(3, 2, figsize=(9, 5), sharex=True, sharey=True, layout="constrained")
for row, receiver in zip(axes, ("left_hand", "left_thigh", "left_foot"), strict=True):
    for axis, source in zip(row, ("source/belly_low", "source/hat"), strict=True):
        own = np.asarray(ranges.source) == ranges.source_names.index(source)
        own &= np.asarray(ranges.receiver) == ranges.receiver_names.index(receiver)
        emitted = raw.pulse_time[raw.pulse_source == raw.recording.setup.sources.index(source)]
        confidence = np.zeros(len(emitted))
        at = np.searchsorted(emitted, np.asarray(ranges.time)[own] - 1e-6)
        confidence[at] = np.asarray(ranges.confidence)[own]
        seen = raw.visible[raw.pulse_source == raw.recording.setup.sources.index(source)]
        seen = seen[:, raw.wires.index(receiver)]
        axis.fill_between(emitted, seen, step="mid", color="0.9", label="in sight")
        axis.plot(emitted, confidence, linewidth=0.9, label="confidence")
        axis.set_title(f"{source.removeprefix('source/')} → {receiver}", size=9)
axes[2, 0].legend(loc="lower right", fontsize=8)
for axis in axes[-1]:
    axis.set(xlabel="time [s]", ylim=(0, 1.05))
plt.show()

# %% [markdown]
# `mocap-jax reconstruct` takes what `mocap-jax decode` writes like any other recording;
# `scripts/reproduce_vlasic2007 --raw` compares the poses with those from measurements that are
# simulated directly, and `scripts/check_ranging` and `scripts/check_telemetry` measure the two
# halves of the chain alone.

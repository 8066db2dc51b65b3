"""
What clearance does
===================

You compare a leg with ideal joints and the same leg with one clearance joint: toe acceleration, joint force, drive torque.
Then you change the size of the clearance and the speed of the crank.
"""

# %%
# The ideal leg
# -------------
#
# The default leg walks at 60 rpm.
# An empty list of clearances makes all joints ideal:

import matplotlib.pyplot as plt
import numpy as np

import leg_wear_monitor as lw

cycles = 10  # gait cycles of each simulation

ideal = lw.simulate("bionic_leg", clearances=[], cycles=1, trace=1440)

print(f"force in joint G: p99 {ideal.joints['G'].p99_force_n:.0f} N")
print(f"drive torque: rms {ideal.drive_torque_nm.rms:.1f} N m")

# %%
# The same leg with a clearance in the knee
# -----------------------------------------
#
# Joint G, the knee, gets a radial clearance of 0.3 mm:

knee = lw.simulate("bionic_leg", clearances=["G"], clearance_m=0.0003, cycles=cycles, trace=1440)

print(f"force in joint G: p99 {knee.joints['G'].p99_force_n:.0f} N")
print(f"drive torque: rms {knee.drive_torque_nm.rms:.1f} N m")
print(f"the toe is off by up to {1e3 * knee.toe.max_position_error_m:.2f} mm")
print(f"its acceleration is off by up to {knee.toe.max_acceleration_error_mps2:.0f} m/s²")

# %%
# The toe leaves its path by little, and its acceleration by much: a clearance is hardly a matter of position, it is a matter of impacts.
#
# Look at one gait cycle
# ----------------------
#
# The trace has 1440 samples of a gait cycle.
# The acceleration of the toe is the second difference of its position.
# It is a mean over some milliseconds, so its spikes are smaller than the largest value above:


def one_cycle(result):
    """Crank angle [°], toe acceleration [m/s²] and drive torque [N m] over one gait cycle."""
    trace, first = result.trace, slice(0, 1440)
    step_s = 60.0 / result.speed_rpm / 1440
    velocity = np.gradient([trace.toe_x_m, trace.toe_y_m], step_s, axis=1)
    acceleration = np.hypot(*np.gradient(velocity, step_s, axis=1))
    angle = np.rad2deg(trace.crank_angle_rad)[first] % 360
    return angle, acceleration[first], trace.drive_torque_nm[first]


figure, (toe, torque) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
for name, result in (("clearance of 0.3 mm in G", knee), ("ideal", ideal)):
    angle, acceleration, torque_nm = one_cycle(result)
    toe.plot(angle, acceleration, linewidth=0.8, label=name)
    torque.plot(angle, torque_nm, linewidth=0.8, label=name)
toe.set(ylabel="toe acceleration [m/s²]")
torque.set(xlabel="crank angle [°]", ylabel="drive torque [N m]", xlim=(0, 360))
toe.legend()
plt.show()

# %%
# Each spike is an impact of the journal on its bushing.
# For most of the gait cycle both legs move alike.
#
# Which numbers repeat
# --------------------
#
# Motion with clearance is chaotic: a tiny change of the start changes every single impact.
# Skip the gait cycles that you have simulated, count the next ones, and compare:

later = lw.simulate("bionic_leg", clearances=["G"], clearance_m=0.0003, cycles=cycles, skip_cycles=1 + cycles)

for name, result in (("first", knee), ("later", later)):
    force = result.joints["G"]
    print(f"{name}: mean {force.mean_force_n:.1f} N, p99 {force.p99_force_n:.0f} N, ", end="")
    print(f"max {force.max_force_n:.0f} N")

# %%
# The mean repeats within two percent.
# p99 repeats within a quarter, and better over more cycles.
# The maximum is one sample of a single impact and need not repeat at all.
# So compare means and p99, and let the leg walk for long.
#
# A larger clearance
# ------------------

sizes_mm = [0.1, 0.3, 0.5]
by_size = [
    lw.simulate("bionic_leg", clearances=["G"], clearance_m=1e-3 * size, cycles=cycles) for size in sizes_mm
]

for size, result in zip(sizes_mm, by_size, strict=True):
    toe = result.toe
    print(f"{size} mm: toe off by up to {1e3 * toe.max_position_error_m:.2f} mm, ", end="")
    print(f"{toe.max_acceleration_error_mps2:.0f} m/s²")

# %%
# A faster crank
# --------------

speeds_rpm = [30, 60, 90, 120]
by_speed = [
    lw.simulate("bionic_leg", clearances=["G"], clearance_m=0.0003, speed_rpm=speed, cycles=cycles)
    for speed in speeds_rpm
]

for speed, result in zip(speeds_rpm, by_speed, strict=True):
    force = result.joints["G"]
    print(f"{speed} rpm: p99 {force.p99_force_n:.0f} N, ", end="")
    print(f"Archard integral {force.archard_integral_j_per_cycle:.2f} J a cycle")

# %%
# The crank is four times as fast in the last line as in the first, and the force and the Archard integral, which is wear, are more than four times as great.

# %%
# The picture of both
# -------------------

figure, (size, speed) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
size.plot(sizes_mm, [1e3 * result.toe.max_position_error_m for result in by_size], "o-")
size.set(xlabel="radial clearance of G [mm]", ylabel="toe off by up to [mm]", xlim=(0, None), ylim=(0, None))
speed.plot(speeds_rpm, [result.joints["G"].p99_force_n for result in by_speed], "o-", label="0.3 mm in G")
ideal_n = [
    lw.simulate("bionic_leg", clearances=[], cycles=1, speed_rpm=rpm).joints["G"].p99_force_n
    for rpm in speeds_rpm
]
speed.plot(speeds_rpm, ideal_n, "o--", label="ideal")
speed.set(xlabel="crank speed [rpm]", ylabel="p99 of the force in G [N]", xlim=(0, None), ylim=(0, None))
speed.legend()
plt.show()

# %%
# The toe error grows with the clearance, and the force grows with the speed.
#
# You have done a parameter study in small.
# `The studies <../appendix/study.html>`_ do it with ensembles, for every place and several joints at once; ``leg-wear-monitor study size --out size/`` makes the page of one.
# `Physics <../explanation/physics.html>`_ has the equations.

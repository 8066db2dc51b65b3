"""
Your own linkage from a sketch
==============================

You write the mechanism file of a four-bar linkage and check it, look at its ideal motion, and give two of its pins clearance.
Then you do the same with a Klann leg, a six-bar linkage whose toe walks.
"""

# %%
# Sketch a four-bar linkage
# -------------------------
#
# Draw the linkage at one angle of its crank, on squared paper, and read the place of each pin in metres:
#
# .. code-block:: text
#
#    pin                          name   x [m]    y [m]
#    crank pivot, on the ground   A      0.000    0.000
#    crank pin                    B      0.050    0.000
#    rocker pin                   C      0.182    0.149
#    rocker pivot, on the ground  D      0.200    0.000
#    a point to follow            toe    0.080    0.130
#
# Write the mechanism file
# ------------------------
#
# A body has a mass, a moment of inertia, a centre of mass, and the points that it carries.
# Let the frame of each body lie on the sketch: then its points are those of the table, and in the assembly each body is at ``[0, 0, 0]``.
# The crank angle of the sketch is 0.

import subprocess
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import leg_wear_monitor as lw

FOUR_BAR = """
name: my_four_bar
gravity: [0.0, -9.81]

ground:
  points: {A: [0.000, 0.000], D: [0.200, 0.000]}

bodies:   # a bar of mass m and length l has the moment of inertia m l^2 / 12
  crank:
    {mass: 0.4, inertia: 8.3e-5, com: [0.025, 0.000],
     points: {A: [0.000, 0.000], B: [0.050, 0.000]}}
  coupler:
    {mass: 0.8, inertia: 2.6e-3, com: [0.116, 0.075],
     points: {B: [0.050, 0.000], C: [0.182, 0.149], toe: [0.080, 0.130]}}
  rocker:
    {mass: 0.6, inertia: 1.1e-3, com: [0.191, 0.075],
     points: {C: [0.182, 0.149], D: [0.200, 0.000]}}

joints:   # bushing: the body with the hole; journal: the body with the pin
  A: {bushing: ground, journal: crank}
  B: {bushing: coupler, journal: crank}
  C: {bushing: rocker, journal: coupler}
  D: {bushing: ground, journal: rocker}

drive: {body: crank, speed: 12.566}   # rad/s: 120 rpm

assembly:
  crank_angle: 0.0
  crank: [0.0, 0.0, 0.0]
  coupler: [0.0, 0.0, 0.0]
  rocker: [0.0, 0.0, 0.0]

clearances:
  defaults:
    bushing_radius: 0.008      # m
    width: 0.015               # m
    radial_clearance: 0.0003   # m
    youngs_modulus: 2.07e11    # Pa
    poissons_ratio: 0.29
    friction: {coefficient: 0.05}
    wear_coefficient: 1.0e-15  # 1/Pa
  joints: [B, C]
"""

folder = Path(tempfile.mkdtemp())  # or a folder of yours
written = (folder / "four_bar.yaml").write_text(FOUR_BAR)

# %%
# Check it
# --------


def terminal(command):
    """Run a command in the folder and print its answer."""
    done = subprocess.run(command.split(), cwd=folder, capture_output=True, text=True)
    print(done.stdout + done.stderr)


terminal("leg-wear-monitor check four_bar.yaml")

# %%
# The linkage has a mobility of 1, it closes, and its crank turns through.
# Now make a mistake that everybody makes once, a mass in grams:

written = (folder / "grams.yaml").write_text(FOUR_BAR.replace("mass: 0.8", "mass: 800.0"))
terminal("leg-wear-monitor check grams.yaml")

# %%
# The warning names the key, the value and the likely unit.
#
# Look at it
# ----------
#
# The picture is the best check of all: does it look like the sketch?

four_bar = lw.load_mechanism(folder / "four_bar.yaml")
lw.plot(four_bar)
plt.show()

# %%
# The line with dots is the path of the toe.
# ``leg-wear-monitor draw four_bar.yaml`` writes a page that moves the linkage.
#
# A linkage that does not work is drawn, too.
# Put a decimal point in the wrong place, a crank of 500 mm:

crank_of_500_mm = FOUR_BAR.replace("B: [0.050, 0.000]}}", "B: [0.500, 0.000]}}")
written = (folder / "long.yaml").write_text(crank_of_500_mm)
terminal("leg-wear-monitor draw long.yaml")

lw.plot(lw.load_mechanism(folder / "long.yaml"))
plt.show()

# %%
# The command names what is wrong, with numbers, and the picture shows it.
#
# Drive the ideal linkage
# -----------------------
#
# Without clearances the motion is exact, and the drive torque follows from it:

ideal = lw.simulate(four_bar, clearances=[], cycles=1, trace=720)

print(f"largest drive torque: {ideal.drive_torque_nm.max_abs:.2f} N m")
for joint, forces in ideal.joints.items():
    print(f"{joint}: largest force {forces.max_force_n:.0f} N")

# %%
# Give the pins clearance
# -----------------------
#
# The file names B and C as clearance joints, each with a radial clearance of 0.3 mm:

loose = lw.simulate(four_bar, cycles=5, trace=720)

print(f"largest drive torque: {loose.drive_torque_nm.max_abs:.2f} N m")
for joint in loose.clearance_joints:
    result = loose.joints[joint]
    contact = 100 * result.contact_fraction
    print(f"{joint}: largest force {result.max_force_n:.0f} N, in contact {contact:.0f} % of the time")
print(f"the toe is off by up to {1e3 * loose.toe.max_position_error_m:.2f} mm")

# %%
# The load holds the pins of this linkage to their bushings nearly all the time, so the forces are little greater than those of the ideal linkage.
# But the toe is off its path by more than each of the clearances.
#
# Now a leg that walks
# --------------------
#
# A Klann leg has a crank, a connecting rod, two rockers and a leg: five moving bodies and seven pins, and 3 × 5 − 2 × 7 = 1.
# The proportions of this one are those of an `optimized Klann leg <http://boim.com/Walkin8r/Klann.html>`_, five millimetres for each of its units.
# The pins at the crank angle of the sketch:
#
# .. code-block:: text
#
#    pin                                 name   x [m]     y [m]
#    crank pivot, on the ground          A      0.0000    0.0000
#    crank pin                           B      0.0875    0.0000
#    lower rocker pivot, on the ground   C      -0.1940   -0.0625
#    rod on the lower rocker             D      -0.1058   0.0166
#    upper rocker pivot, on the ground   E      -0.0730   0.2095
#    leg on the upper rocker             F      -0.1740   0.3469
#    knee: rod on the leg                G      -0.2717   0.0755
#    toe                                 toe    -0.2010   -0.2110

KLANN = """
name: my_klann_leg
gravity: [0.0, -9.81]

ground:
  points: {A: [0.0, 0.0], C: [-0.1940, -0.0625], E: [-0.0730, 0.2095]}

bodies:
  crank:
    {mass: 0.2, inertia: 1.3e-4, com: [0.044, 0.000],
     points: {A: [0.0, 0.0], B: [0.0875, 0.0]}}
  rod:
    {mass: 0.8, inertia: 9.0e-3, com: [-0.092, 0.038],
     points: {B: [0.0875, 0.0], D: [-0.1058, 0.0166], G: [-0.2717, 0.0755]}}
  lower_rocker:
    {mass: 0.2, inertia: 2.3e-4, com: [-0.150, -0.023],
     points: {C: [-0.1940, -0.0625], D: [-0.1058, 0.0166]}}
  upper_rocker:
    {mass: 0.3, inertia: 7.3e-4, com: [-0.124, 0.278],
     points: {E: [-0.0730, 0.2095], F: [-0.1740, 0.3469]}}
  leg:
    {mass: 1.2, inertia: 3.2e-2, com: [-0.216, 0.070],
     points: {F: [-0.1740, 0.3469], G: [-0.2717, 0.0755], toe: [-0.2010, -0.2110]}}

joints:
  A: {bushing: ground, journal: crank}
  B: {bushing: rod, journal: crank, label: crank pin}
  C: {bushing: lower_rocker, journal: ground}
  D: {bushing: rod, journal: lower_rocker}
  E: {bushing: upper_rocker, journal: ground}
  F: {bushing: leg, journal: upper_rocker}
  G: {bushing: leg, journal: rod, label: knee}

drive: {body: crank, speed: 6.283}   # rad/s: 60 rpm

assembly:
  crank_angle: 0.0
  crank: [0.0, 0.0, 0.0]
  rod: [0.0, 0.0, 0.0]
  lower_rocker: [0.0, 0.0, 0.0]
  upper_rocker: [0.0, 0.0, 0.0]
  leg: [0.0, 0.0, 0.0]

clearances:
  defaults:
    bushing_radius: 0.008
    width: 0.015
    radial_clearance: 0.0003
    youngs_modulus: 2.07e11
    poissons_ratio: 0.29
    friction: {coefficient: 0.05}
    wear_coefficient: 1.0e-15
  joints: [B, G]
"""

written = (folder / "klann.yaml").write_text(KLANN)
klann = lw.load_mechanism(folder / "klann.yaml")

lw.plot(klann)
plt.show()

# %%
# The path of the toe is flat below, where the foot is on the ground, and high above, where the leg swings.
#
# What the clearances do to the step
# ----------------------------------
#
# Simulate one gait cycle of the ideal leg and one with clearances in the crank pin and in the knee, and compare the toes:

ideal_toe = lw.simulate(klann, clearances=[], cycles=1, trace=720).trace
loose_toe = lw.simulate(klann, cycles=1, trace=720).trace
off_x, off_y = loose_toe.toe_x_m - ideal_toe.toe_x_m, loose_toe.toe_y_m - ideal_toe.toe_y_m
off_mm = 1e3 * np.hypot(off_x, off_y)

figure, (path, error) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
path.plot(ideal_toe.toe_x_m, ideal_toe.toe_y_m, label="ideal")
path.plot(loose_toe.toe_x_m, loose_toe.toe_y_m, "--", label="with clearances")
path.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="path of the toe")
path.legend()
error.plot(np.rad2deg(ideal_toe.crank_angle_rad), off_mm)
error.set(xlabel="crank angle [°]", ylabel="toe off the ideal path [mm]", ylim=(0, None))
plt.show()

# %%
# Two clearances of 0.3 mm move the toe by more than 0.3 mm, because the links are levers.
#
# You have described a leg of your own.
# `The mechanism file <../reference/mechanism_file.html>`_ lists all keys: springs, loads, sliders, other drives.
# `Commission a robot <../howto/commission.html>`_ comes next, if the leg exists.

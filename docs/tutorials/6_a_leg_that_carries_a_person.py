"""
A leg that carries a person
===========================

You put the leg on the ground, hang a person's leg on it, and see which joints wear then.
Then you let it wear through days of standing, walking and carrying, and learn what the monitor must be told.
"""

# %%
# In the air and on the ground
# ----------------------------
#
# The default leg walks in the air.
# ``with_ground_reaction`` lets the ground push its toe as it pushes a person's foot in stance.
# The number is the largest vertical force: someone of 75 kg has 800 N, and an exoskeleton that carries a part of it has less.

import matplotlib.pyplot as plt

import leg_wear_monitor as lw

cycles = 10  # gait cycles of each simulation
leg = lw.load_mechanism("bionic_leg")
loads_n = (0, 300, 600)

results = [lw.simulate(lw.with_ground_reaction(leg, load_n), cycles=cycles) for load_n in loads_n]

print("mean force [N] in")
for load_n, result in zip(loads_n, results, strict=True):
    forces = [f"{joint} {result.joints[joint].mean_force_n:4.0f}" for joint in result.clearance_joints]
    print(f"{load_n:3} N:", ", ".join(forces))

# %%
# At 600 N the ankle (I) carries fifteen times its force in the air, the hip (A) not even twice.
#
# Which joints wear
# -----------------
#
# The Archard integral, force times sliding distance in a gait cycle, says how fast a joint wears:


def archard(result):
    """Archard integral [J] in a gait cycle by joint."""
    return [result.joints[joint].archard_integral_j_per_cycle for joint in result.clearance_joints]


figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
for k, (load_n, result) in enumerate(zip(loads_n, results, strict=True)):
    places = [i + 0.25 * (k - 1) for i in range(len(result.clearance_joints))]
    axes.bar(places, archard(result), width=0.25, label=f"{load_n} N")
axes.set_xticks(range(len(leg.clearance_joints)), leg.clearance_joints)
axes.set(xlabel="joint", ylabel="Archard integral [J/cycle]")
axes.legend(title="vertical force")
plt.show()

air, _, ground = map(archard, results)
for joint, before, after in zip(leg.clearance_joints, air, ground, strict=True):
    print(f"{joint}: {after / before:.1f} times the wear of the air")

# %%
# The joints change places: in the air the hip's thigh side (B) wears before the knee (G), on the ground after it.
# A monitor that does not know the load counts too little wear, and of the wrong joints.
#
# Hang a person's leg on it
# -------------------------
#
# A leg has a sixth of a person's mass.
# ``with_person`` adds thigh, shank and foot of a person of 80 kg to the bodies with these names:

carrying = lw.with_person(leg, 80.0)
for name in ("thigh", "shank", "foot"):
    print(f"{name}: {leg.bodies[name].mass:.1f} kg, with the person {carrying.bodies[name].mass:.1f} kg")

carried = lw.simulate(lw.with_ground_reaction(carrying, 600), cycles=cycles)
print(f"drive torque: rms {results[-1].drive_torque_nm.rms:.0f} N m without the person's leg, "
      f"{carried.drive_torque_nm.rms:.0f} N m with it")  # fmt: skip
for joint, before, after in zip(leg.clearance_joints, ground, archard(carried), strict=True):
    print(f"{joint}: {after / before:.1f} times the wear without it")

# %%
# The drive swings the person's leg, too: its torque grows by more than half, and every joint wears faster.
#
# A day of standing, walking and carrying
# ---------------------------------------
#
# No leg carries the same load all day.
# A duty says for how many hours it walks under each:

duty = lw.Duty({0.0: 2.0, 300.0: 5.0, 600.0: 1.0})
limit_m = 0.0004
settings = lw.LifeSettings(legs=1, cycles=2)

by_day = lw.simulate_life(lw.LifeRun(leg, settings, duty=duty), limit_m=limit_m, horizon_cycles=1e9)
in_air = lw.simulate_life(lw.LifeRun(leg, settings), limit_m=limit_m, horizon_cycles=1e9)

for name, life in (("in the air", in_air), ("by duty", by_day)):
    print(
        f"{name}: joint A has opened by 0.1 mm after {life.cycles_to(0, limit_m) / 3600:.0f} hours at 60 rpm"
    )

# %%
# What the monitor must be told
# -----------------------------
#
# Three parameters say what the leg carries:
#
# - ``load.model: ground`` if nothing measures the force at the foot: the monitor estimates it from the drive torque, as the stance of a person.
# - ``load.model: measured`` and ``foot_load.source`` if there is an insole or a force plate: the mean of the last ten gait cycles acts.
# - ``load.person_kg`` if a person's leg hangs on the linkage; it should be right to 20 %.
#
# Without them a leg on the ground is told as such, with the load that it seems to carry and the parameter that is missing.
# ``bags/ground.mcap`` is a recording of a leg under 300 N whose knee opens; replay it with ``--config bags/ground.yaml``.
# `The parameters <../reference/parameters.html>`_ describe them, and `the physics <../explanation/physics.html>`_ what is known about stance and segments.

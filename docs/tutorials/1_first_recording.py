"""
Your first recording in ten minutes
===================================

You install the package, simulate a leg, and replay two recordings: one of a healthy leg, and one of a leg whose knee bushing breaks.
At the end you can read a verdict and the values behind it.

Install
-------

In a checkout of the package, with Python 3.11 or newer, as in its README:

.. code-block:: console

   $ python3 -m venv build/python
   $ . build/python/bin/activate
   $ pip install '.[bags]'

Then start Python or Jupyter in this environment.
`Installation <../installation.html>`_ explains other ways.
"""

# %%
# Simulate a leg
# --------------
#
# The command ``leg-wear-monitor`` belongs to a terminal.
# This function types it for you, so that the lesson can show the answer:

import subprocess

import matplotlib.pyplot as plt

import leg_wear_monitor as lw

checkout = lw.share_directory()


def terminal(command):
    """Run a command in the checkout and print its answer."""
    done = subprocess.run(command.split(), cwd=checkout, capture_output=True, text=True)
    answer = done.stdout + done.stderr
    print(answer.replace(f"{checkout}/", ""))


terminal("leg-wear-monitor simulate")

# %%
# A leg with a clearance of 0.3 mm in five joints has walked five gait cycles.
# Each row is a joint.
# *mean*, *p99* and *max* are statistics of its force; *contact* is the fraction of the time in which journal and bushing touch.
# *Archard* is force times sliding distance in a gait cycle: the greater it is, the faster the joint wears.
# Find the joint with the greatest value: it is A, the hip.
#
# Replay a recording of a healthy leg
# -----------------------------------
#
# A recording contains what the robot's sensors said: the crank angle and the drive torque.
# The monitor reads it as if the leg walked now:

healthy = lw.replay(checkout / "bags/healthy.mcap", checkout / "bags/healthy.yaml").summary()

print(healthy.cycles, "gait cycles")
print(healthy.verdict.state.value)
print(healthy.verdict.why)

# %%
# The verdict is the first thing to read.
# It is one word with a reason, and the reason has numbers with their limits.
#
# Replay a recording of a knocking leg
# ------------------------------------
#
# In the second recording the bushing of joint G, the knee, breaks after five seconds.
# Replay it in the terminal, where a verdict comes with everything else:

terminal("leg-wear-monitor replay bags/knocking.mcap --config bags/knocking.yaml")

# %%
# Read it from top to bottom:
#
# 1. **The verdict** is *stop joint G*: the clearance that the drive torque shows is above the limit of 0.6 mm.
# 2. **To do** is what you do next.
# 3. **Code** is the stable name of the reason, and the page that guides you through it.
# 4. **Not valid** lists values that you must not use now.
#    The monitor counted the wear of a leg with sound joints, and this leg is no longer that leg.
#    So the table has no values.
# 5. **Torque** is the clearance of each joint, estimated from the drive torque, with one standard deviation.
# 6. **The alarm** ``torque_mismatch`` is the reason for all this: the torque does not fit the model of this leg.
#
# See it
# ------
#
# The same replay in Python keeps the values of each gait cycle:

config = lw.load_config(checkout / "bags/knocking.yaml")
knocking = lw.replay(checkout / "bags/knocking.mcap", config).summary()

print(knocking.verdict.state.value, knocking.verdict.joints, knocking.verdict.fault_code)
for joint, clearance in knocking.clearances.items():
    if clearance.estimated_m is None:
        print(f"{joint}: not observable")
    else:
        print(f"{joint}: {1e3 * clearance.estimated_m:.2f} ± {1e3 * clearance.estimated_sigma_m:.2f} mm")

# %%
# Draw when it happened, and where:

figure, (when, where) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")

for name, summary in (("healthy", healthy), ("knocking", knocking)):
    when.plot(summary.history.cycle, summary.history.torque_mismatch, "o-", label=name)
when.axhline(config.limits.torque_mismatch, color="gray", linestyle="--", label="limit")
when.set(xlabel="gait cycle", ylabel="torque mismatch", ylim=(0, None))
when.legend()

joints = [joint for joint, one in knocking.clearances.items() if one.estimated_m is not None]
seen = [1e3 * knocking.clearances[joint].estimated_m for joint in joints]
sigma = [1e3 * knocking.clearances[joint].estimated_sigma_m for joint in joints]
where.errorbar(joints, seen, yerr=sigma, fmt="o", capsize=4, label="shown by the torque")
where.axhline(1e3 * knocking.clearances["G"].limit_m, color="gray", linestyle="--", label="limit")
where.set(xlabel="joint", ylabel="radial clearance [mm]", ylim=(0, None))
where.legend(loc="upper left")
plt.show()

# %%
# On the left, the torque mismatch of the knocking leg jumps above its limit in the fifth gait cycle and stays there.
# On the right, only joint G is above the limit.
#
# You have read a verdict.
# `Codes <../reference/codes.html>`_ explains each reason that a verdict can have, `the monitor <../reference/monitor.html>`_ explains each alarm.
# The monitor advises: the absence of an alarm does not mean the joints are healthy.

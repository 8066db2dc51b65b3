"""
A life and its forecast
=======================

You let a leg wear from new until a bushing is worn out, forecast the same life from a recording, and correct the forecast with a clearance that you measured.
"""

# %%
# Let a leg wear
# --------------
#
# A life has millions of gait cycles.
# A simulation of each would take months, so a life goes by jumps: a few cycles are simulated, and their wear is applied to many.
# The life ends when a clearance has doubled, from 0.3 mm to 0.6 mm:

import attrs
import matplotlib.pyplot as plt

import leg_wear_monitor as lw

limit_m = 0.0006
settings = lw.LifeSettings(legs=1, cycles=2)

run = lw.LifeRun(lw.load_mechanism("bionic_leg"), settings)
life = lw.simulate_life(run, limit_m=limit_m, horizon_cycles=1e9)

for k, joint in enumerate(life.clearance_joints):
    print(f"{joint}: {1e3 * life.clearance_m[-1, k]:.3f} mm at the end")
print(f"joint A reaches the limit after {life.cycles_to(0, limit_m):.3g} gait cycles")

# %%
# Joint A, the hip, is the first at its limit, after about 18 million gait cycles: 5000 hours of walking at 60 rpm.

lw.plot(life)
plt.show()

# %%
# The solid lines are mean clearances, the dashed ones the largest: a bushing does not wear evenly.
#
# In the terminal, ``leg-wear-monitor life --clearances A,B,G,I,J --out life/`` does the same.
#
# Forecast it from a recording
# ----------------------------
#
# The monitor does not know the life.
# It counts the wear of the gait cycles that it sees, and forecasts when the limit is reached.
# The recording has only ten gait cycles, in which nothing wears measurably.
# So for this lesson the monitor counts 100 000 times the wear: each recorded cycle stands for 100 000 cycles.
# (On a robot the factor is 1, and with this one the alarms of impact forces mean nothing.)
#
# You measured joint A when it was new: 0.300 mm with a standard deviation of 0.002 mm.
# Without this, a new clearance is known to 10 %, and a later measurement says little about the wear.

factor = 100_000
bags = lw.share_directory() / "bags"
config = attrs.evolve(lw.load_config(bags / "healthy.yaml"), wear_acceleration=factor)


def measured_when_new(monitor):
    """Enter the measurement before the first gait cycle."""
    monitor.measure("A", clearance_m=0.0003, sigma_m=2e-6, stamp_ns=1, who="you")


replayed = lw.replay(bags / "healthy.mcap", config, ready=measured_when_new)
monitor, counted = replayed.monitor, replayed.summary()

walked = factor * counted.cycles
modelled_m = counted.clearances["A"].modelled_m
print(f"after {walked:.3g} gait cycles the modelled clearance of A is {1e3 * modelled_m:.3f} mm")


def hours_left(forecast):
    """Quantiles of the hours left at 60 rpm, of the cycles that are stood for."""
    cycles = forecast.cycles
    return [factor * left / 3600 for left in (cycles.p10, cycles.p50, cycles.p90)]


before = hours_left(counted.joints["A"].forecast)
print("remaining life: p10 {:.0f} h, p50 {:.0f} h, p90 {:.0f} h".format(*before))

# %%
# p50 is near to what the life has left, and the range from p10 to p90 is wide: wear coefficients are known to a factor of two at best.
# The forecast gives the true life a probability of 80 % to lie in this range.
#
# Measure the clearance
# ---------------------
#
# Suppose you stop the robot and measure joint A: 0.325 mm with a standard deviation of 0.002 mm, a little more than counted.
# Give it to the monitor:

now_ns = int(counted.history.stamp_ns[-1])
found = monitor.measure("A", clearance_m=0.000325, sigma_m=2e-6, stamp_ns=now_ns, who="you")
print(found.lines[0])

after = hours_left(monitor.renew_forecast().joints[0].forecast)
print("remaining life: p10 {:.0f} h, p50 {:.0f} h, p90 {:.0f} h".format(*after))

# %%
# One measurement says more than the counting: this leg wears faster than a nominal one, its life is shorter, and the range is less than a third as wide.
#
# On a robot the monitor keeps its wear in a ledger, and the terminal takes the measurement: ``leg-wear-monitor measure A 0.325 --sigma 0.002 --config monitor.yaml --ledger wear.ledger``.
#
# See both forecasts
# ------------------

figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
hours = life.cycles / 3600
axes.plot(hours, 1e3 * life.clearance_m[:, 0], color="gray", label="simulated life of joint A")
axes.axhline(1e3 * limit_m, color="gray", linestyle=":", label="limit")
now = walked / 3600
axes.errorbar(now, 0.325, yerr=0.002, fmt="ks", capsize=4, label="measured")
for (p10, p50, p90), level, name in (
    (before, 0.61, "forecast before"),
    (after, 0.63, "forecast with the measurement"),
):
    spread = [[p50 - p10], [p90 - p50]]
    axes.errorbar(now + p50, level, xerr=spread, fmt="o", capsize=5, linewidth=2, label=name)
axes.set(xlabel="hours of walking", ylabel="mean radial clearance [mm]", xlim=(0, None))
axes.legend(loc="lower right")
plt.show()

# %%
# The bars are the ranges from p10 to p90 of the hour at which joint A reaches its limit, the dots p50.
# Plan maintenance with p10.
#
# `The forecast <../explanation/forecast.html>`_ explains what is uncertain and how often the ranges are right.

"""
A fleet on one page
===================

You describe two legs in a file, count their recordings with one command, and read which leg needs a person, and why.
Then somebody measures a joint, and the next update knows it.

You need the first lesson, and the tables of the extra ``fleet``:

.. code-block:: console

   $ pip install '.[bags,fleet]' pandas
"""

# %%
# Describe the legs
# -----------------
#
# Work in a directory of your own.
# The description names each leg, its recordings and its parameters; ``lot`` says that their bushings come from one delivery:

import subprocess
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import leg_wear_monitor as lw

checkout = lw.share_directory()
home = Path(tempfile.mkdtemp())

(home / "fleet.yaml").write_text(f"""\
legs:
  - id: left-07
    recordings: "{checkout}/bags/healthy.mcap"
    config: "{checkout}/bags/healthy.yaml"
    lot: "2026-03"
  - id: right-07
    recordings: "{checkout}/bags/knocking.mcap"
    config: "{checkout}/bags/knocking.yaml"
    lot: "2026-03"
""")


def terminal(command):
    """Run a command in your directory and print its answer."""
    done = subprocess.run(command.split(), cwd=home, capture_output=True, text=True)
    print((done.stdout + done.stderr).replace(f"{home}/", "").replace(f"{checkout}/", ""))


# %%
# Count what is new
# -----------------

terminal("leg-wear-monitor fleet update fleet.yaml")

# %%
# Two recordings are counted, each into the ledger of its leg.
# A line names each leg that needs a person: *right-07* must stop, because its knee has opened.
# Run the same command again, as a computer would each night:

terminal("leg-wear-monitor fleet update fleet.yaml")

# %%
# A recording counts once, whatever its name.
#
# Ask your own questions
# ----------------------
#
# The tables are pandas frames:

fleet = lw.Fleet(home / "fleet")
verdicts = fleet.verdicts()
print(verdicts[["leg", "lot", "state", "joints", "fault_code"]].to_string(index=False))

# %%
# ``lives()`` has a row for each joint: the clearance that is counted, the one that the torque shows, and the remaining life.
# Where the verdict does not believe the forecast, it is empty.

lives = fleet.lives()
print(lives[["leg", "joint", "seen_m", "limit_m", "p10_h", "p50_h"]].to_string(index=False))

# %%
# Enter a measurement
# -------------------
#
# Somebody measures joint A of *left-07* with a dial, and finds 0.31 mm:

parameters = f"--config {checkout}/bags/healthy.yaml"
terminal(f"leg-wear-monitor measure A 0.31 --sigma 0.01 {parameters} --ledger fleet/legs/left-07/ledger")

# %%
# The measurement is in the ledger of this leg.
# Bushings of one delivery are alike, so the next update of the fleet lets the other legs of the lot learn from it, too:
# `Learning across legs <../explanation/learning.html>`_ explains how.
#
# See it
# ------
#
# ``leg-wear-monitor fleet report fleet.yaml`` writes one page for all legs, and a page for each.
# Here you draw the part that matters yourself: the clearance of each joint compared with its limit.

joints = lives[lives.joint != "leg"].pivot(index="leg", columns="joint", values="seen_m")
limit_mm = 1e3 * float(lives.limit_m.max())

figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
for leg, row in joints.iterrows():
    axes.plot(row.index, 1e3 * row, "o", label=leg)
axes.axhline(limit_mm, color="gray", linestyle="--", label="limit")
axes.set(xlabel="joint", ylabel="radial clearance by the torque [mm]", ylim=(0, None))
axes.legend()
plt.show()

# %%
# One point is above the limit: joint G of *right-07*, as the verdict says.
# `Monitor many legs <../howto/fleet.html>`_ has the rest: months of recordings, several computers, and what happens if a file is damaged.

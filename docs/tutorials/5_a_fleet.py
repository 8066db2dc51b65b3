"""
A fleet on one page
===================

You describe two legs in a file, count their recordings with one command, and read which leg needs a person, and why.
Then you enter a measured clearance, and the next update shows it.

You need the first lesson, and pandas:

.. code-block:: console

   $ pip install '.[bags]' pandas
"""

# %%
# Describe the legs
# -----------------
#
# Work in a directory of your own.
# The description names each leg, its recordings and its parameters:

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
  - id: right-07
    recordings: "{checkout}/bags/knocking.mcap"
    config: "{checkout}/bags/knocking.yaml"
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
# The table is a pandas frame with one row per leg, the worst leg first.
# Where the verdict does not believe the forecast, the remaining life is empty:

legs = lw.Fleet(home / "fleet").to_pandas()
print(
    legs[["leg", "state", "fault_code", "worst_joint", "clearance_m", "limit_m", "life_p10_h"]].to_string(
        index=False
    )
)

# %%
# Enter a measurement
# -------------------
#
# Somebody measures joint A of *left-07* with a dial, and finds 0.31 mm:

parameters = f"--config {checkout}/bags/healthy.yaml"
terminal(f"leg-wear-monitor measure A 0.31 --sigma 0.01 {parameters} --ledger fleet/legs/left-07/ledger")

# %%
# The measurement is in the ledger of this leg.
# The next update shows the clearance that the ledger now has:

terminal("leg-wear-monitor fleet update fleet.yaml")
measured = lw.Fleet(home / "fleet").overview.leg("left-07")
print(measured.state.clearances["A"])

# %%
# See it
# ------
#
# The update has written one page for all legs, ``fleet/report.html``, and a page for each leg.
# Here you draw the part that matters yourself: the clearance of the worst joint of each leg, compared with its limit.

figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
axes.bar(legs.leg + ", joint " + legs.worst_joint, 1e3 * legs.clearance_m, width=0.5)
axes.axhline(1e3 * legs.limit_m.max(), color="gray", linestyle="--", label="limit")
axes.set(ylabel="radial clearance [mm]")
axes.legend()
plt.show()

# %%
# One bar is above the limit: joint G of *right-07*, as the verdict says.
# `Monitor many legs <../howto/fleet.html>`_ has the rest: months of recordings, several computers, and damaged files.

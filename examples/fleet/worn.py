"""The legs of a fleet, and the most worn joint of each: python examples/fleet/worn.py build/fleet."""

import sys

import leg_wear_monitor as lw

for leg in lw.Fleet(sys.argv[1]).to_pandas().itertuples():
    print(f"{leg.leg}: {leg.state} {leg.fault_code}; {leg.worst_joint} {1e3 * leg.clearance_m:.2f} mm")

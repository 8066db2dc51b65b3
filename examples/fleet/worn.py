"""The legs of a fleet, and the most worn joint of each: python examples/fleet/worn.py build/fleet."""

import sys

import leg_wear_monitor as lw

fleet = lw.Fleet(sys.argv[1])
lives = fleet.lives()
for leg in fleet.verdicts().itertuples():
    joints = lives[(lives.leg == leg.leg) & (lives.joint != "leg")].set_index("joint")
    most = joints.seen_m.idxmax()
    print(f"{leg.leg}: {leg.state} {leg.fault_code}; {most} {1e3 * joints.seen_m[most]:.2f} mm by the torque")

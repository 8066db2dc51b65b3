"""What clearance does to a linkage of one's own: python examples/own_linkage/walk.py."""

from pathlib import Path

import leg_wear_monitor as lw

four_bar = lw.load_mechanism(Path(__file__).with_name("four_bar.yaml"))
for clearances in ([], ["B", "C"]):
    result = lw.simulate(four_bar, clearances=clearances, cycles=3)
    largest = ", ".join(f"{name} {joint.max_force_n:.0f} N" for name, joint in result.joints.items())
    print(
        f"clearance in {', '.join(clearances) or 'none'}: {result.drive_torque_nm.max_abs:.2f} N m; {largest}"
    )

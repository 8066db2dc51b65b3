"""The figures of the paper's sections 6 and 7: clearance in hip, knee and foot, and in all five joints.

``python examples/paper/figures.py OUT [CYCLES]`` writes OUT/hip.pdf, knee.pdf, foot.pdf and all.pdf. With 100
gait cycles in a Poincaré section, the default, it takes a few minutes.
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import leg_wear_monitor as lw

PLACES = {"hip": ["A", "B"], "knee": ["G"], "foot": ["I", "J"], "all": ["A", "B", "G", "I", "J"]}
RESPONSES = ("displacement", "velocity", "acceleration", "torque", "force")
OF_JOINTS = ("portrait", "poincare", "wear")
COLUMN_INCH = 3.6, 2.7


def main(out: Path, cycles: int) -> None:
    """Write one page per place."""
    out.mkdir(parents=True, exist_ok=True)
    for name, joints in PLACES.items():
        leg = {"clearances": joints, "clearance_m": 3.0e-4, "speed_rpm": 60.0, "skip_cycles": 5.0}
        # two gait cycles for curves; a portrait needs fine samples; a section has one sample per gait cycle
        curves = lw.simulate("bionic_leg", cycles=2, trace=512, **leg)
        fine = lw.simulate("bionic_leg", cycles=2, trace=4096, **leg)
        section = lw.simulate("bionic_leg", cycles=cycles, trace=1, **leg)
        results = {"portrait": fine, "poincare": section, "wear": section}

        rows = (len(RESPONSES) + 1) // 2 + len(joints) * len(OF_JOINTS) // 2 + 1
        page = Figure(figsize=(2 * COLUMN_INCH[0], rows * COLUMN_INCH[1]), layout="constrained")
        pictures = [(kind, "") for kind in RESPONSES]
        pictures += [(kind, joint) for joint in joints for kind in OF_JOINTS]
        for number, (kind, joint) in enumerate(pictures, start=1):
            projection = "polar" if kind == "wear" else None
            axes = page.add_subplot(rows, 2, number, projection=projection)
            which = {"joint": joint} if joint else {}
            lw.plot(results.get(kind, curves), axes, kind=kind, **which)
        page.savefig(out / f"{name}.pdf")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 100)

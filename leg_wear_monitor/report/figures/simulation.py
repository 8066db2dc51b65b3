"""Figures of a simulation as PNG files."""

from leg_wear_monitor.dynamics.result.simulation_result import SimulationResult
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.report.figures.figure import png
from leg_wear_monitor.report.figures.force_traces import force_traces
from leg_wear_monitor.report.figures.leg_picture import leg_picture
from leg_wear_monitor.report.figures.worn_bushings import worn_bushings


def pictures(mechanism: Mechanism, result: SimulationResult) -> dict[str, bytes | None]:
    """PNG files by file name; None for a figure that needs data which the result does not contain."""
    files: dict[str, bytes | None] = {
        "leg.png": png(leg_picture(mechanism, result.clearance_joints)),
        "wear.png": None,
        "forces.png": None,
    }
    if result.trace is not None:
        files["forces.png"] = png(
            force_traces(result.trace, result.clearance_joints or tuple(mechanism.joints))
        )
    if result.surfaces is not None and result.clearance_joints:
        radii = tuple(mechanism.clearances[name].bushing_radius for name in result.clearance_joints)
        cycles = abs(result.speed_rpm) / 60.0 * result.simulated_s
        files["wear.png"] = png(worn_bushings(result.surfaces, result.clearance_joints, radii, cycles))
    return files

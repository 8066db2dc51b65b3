"""Summary of a mechanism in everyday units, in which a wrong unit is obvious."""

from collections.abc import Iterator

import numpy as np

from leg_wear_monitor.mechanism.ideal import TURN, one_cycle, point_motion
from leg_wear_monitor.mechanism.materials.of_joints import regimes
from leg_wear_monitor.mechanism.plausible import largest_link
from leg_wear_monitor.mechanism.position import Linkage
from leg_wear_monitor.mechanism.spec import Mechanism, SpeedDrive, TorqueDrive

_POINTS = 180  # crank steps per turn: enough for a stride with an error of 0.1 %


def understood(linkage: Linkage) -> tuple[str, ...]:
    """Statements on the size, mass, drive, stride and clearances of a mechanism, with units."""
    return tuple(_statements(linkage))


def _statements(linkage: Linkage) -> Iterator[str]:
    mechanism = linkage.mechanism
    link, length = largest_link(mechanism)
    yield f"largest link {length:.4g} m ({link})"
    body = max(mechanism.bodies, key=lambda name: mechanism.bodies[name].mass)
    yield f"heaviest mass {mechanism.bodies[body].mass:.4g} kg ({body})"
    yield _drive(mechanism)
    if mechanism.toe is not None:
        x, y = point_motion(one_cycle(linkage, _POINTS, 1.0), linkage, *mechanism.toe)[0].T
        yield f"toe's stride {np.ptp(x):.4g} m, lift {np.ptp(y):.4g} m"
    yield from _clearances(mechanism)


def _drive(mechanism: Mechanism) -> str:
    drive = mechanism.drive
    if isinstance(drive, TorqueDrive):
        return f"crank driven by {drive.torque:.4g} N m"
    speed = drive.speed if isinstance(drive, SpeedDrive) else drive.track.speed_radps
    sense = "counter-clockwise" if speed > 0.0 else "clockwise"
    return f"crank {60.0 * abs(speed) / TURN:.4g} rpm {sense}"


def _clearances(mechanism: Mechanism) -> Iterator[str]:
    """Young's moduli and clearances of the clearance joints, each value once."""
    clearance_joints = [mechanism.clearances[joint] for joint in mechanism.clearance_joints]
    moduli = sorted({modulus for c in clearance_joints for modulus in c.youngs_modulus})
    if moduli:
        yield "E " + " and ".join(f"{1.0e-9 * modulus:.4g}" for modulus in moduli) + " GPa"
    yield from _pairs(mechanism)
    for fresh, radius in sorted({(c.radial_clearance, c.bushing_radius) for c in clearance_joints}):
        ratio = 100.0 * fresh / radius
        yield f"clearance {1.0e3 * fresh:.4g} mm in a radius of {1.0e3 * radius:.4g} mm ({ratio:.2g} %)"


def _pairs(mechanism: Mechanism) -> Iterator[str]:
    """Material pairs of the clearance joints, with regime and wear coefficients."""
    for what, names in regimes(mechanism, mechanism.clearance_joints).items():
        yield f"material of {', '.join(names)}: {what}"

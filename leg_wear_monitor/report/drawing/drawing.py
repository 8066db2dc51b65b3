"""What a picture of a mechanism shows, whatever it is written as."""

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN, ideal_motion
from leg_wear_monitor.mechanism.reach.reach import POINTS, Reach, reach_of
from leg_wear_monitor.mechanism.reach.words import findings, headline
from leg_wear_monitor.mechanism.spec import Mechanism, SpeedDrive, TorqueDrive

CREATOR = "leg-wear-monitor draw"  # in the head of every drawing: the command replaces no other file
_SAME = 1.0e-9  # rad


@attrs.frozen(eq=False)
class Drawing:
    """A picture of a mechanism.

    Attributes
    ----------
    reach : Reach
        Its positions.
    shown : int
        Position that is shown first.
    forces_n : (p, j, 2) array or None
        Force on the journal's or slider's body in each joint; None if they are not drawn.
    """

    reach: Reach
    shown: int
    forces_n: Floats | None = None

    @property
    def headline(self) -> str:
        """In a few words, whether the mechanism works."""
        return headline(self.reach)

    @property
    def findings(self) -> tuple[str, ...]:
        """What is wrong with the mechanism; empty if it closes and turns."""
        return findings(self.reach)


def drawing_of(
    mechanism: Mechanism, crank_angle: float | None = None, has_forces: bool = False, points: int = POINTS
) -> Drawing:
    """The picture of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
    crank_angle : float, optional
        Crank angle [rad] of the position that is shown first. Default: 0 if the crank turns through, else the
        dead point in its direction; that of the assembly if the mechanism does not close there.
    has_forces : bool
        Whether the forces in the joints are drawn: those at the speed of the drive, without clearance.
    points : int
        Positions over the range of the crank.

    Raises
    ------
    ConfigError
        If the crank does not reach the angle, or the forces are not known.
    """
    reach = reach_of(mechanism, crank_angle, points)
    shown = _first(reach) if crank_angle is None else _position(reach, crank_angle)
    return Drawing(reach, shown, _forces(reach) if has_forces else None)


def _first(reach: Reach) -> int:
    if reach.turns or reach.open_joint or reach.low is None:
        return 0
    return len(reach.q) - 1 if _drive(reach.mechanism) >= 0.0 else 0


def _drive(mechanism: Mechanism) -> float:
    """Speed [rad/s] of the drive, or its torque [N m]."""
    drive = mechanism.drive
    if isinstance(drive, TorqueDrive):
        return drive.torque
    return drive.speed if isinstance(drive, SpeedDrive) else drive.track.speed_radps


def _position(reach: Reach, crank_angle: float) -> int:
    """The position at a crank angle [rad]."""
    away = np.abs((reach.crank_angle - crank_angle + 0.5 * TURN) % TURN - 0.5 * TURN)
    i = int(away.argmin())
    if away[i] > _SAME:
        fault = f"{np.rad2deg(crank_angle):g} deg cannot be drawn: {headline(reach)}"
        raise ConfigError("--crank-angle", "", fault)
    return i


def _forces(reach: Reach) -> Floats:
    if not reach.turns:
        raise ConfigError("--forces", "", f"there are no forces over a cycle: {headline(reach)}")
    if isinstance(reach.mechanism.drive, TorqueDrive):
        raise ConfigError(
            "--forces", "", "drive.torque does not tell the speed, expected drive.speed in the file"
        )
    return ideal_motion(reach.linkage, reach.crank_angle, _drive(reach.mechanism)).joint_force

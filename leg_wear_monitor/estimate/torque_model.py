"""Drive torque of a leg: T = S + w D + w^2 H + a J, each a table over the crank angle."""

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.tables import POINTS
from leg_wear_monitor.estimate.body_torques import torque_coefficients
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.load import load_shape, load_signatures

PHASE_ERROR_RAD = 0.02
"""Standard deviation by which clearances of 0.3 mm in five joints shift the torque's phase."""


def at_angles(tables: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Values (..., n) of periodic tables (..., points) at angles (n,), and their slopes by the angle."""
    points = tables.shape[-1]
    place = (angle / TURN) % 1.0 * points
    left = np.minimum(place.astype(np.int64), points - 1)
    values = tables[..., left]
    step = tables[..., (left + 1) % points] - values
    return values + (place - left) * step, step * (points / TURN)


@attrs.frozen(kw_only=True)
class ModelError:
    """Standard deviations of the effects of clearances that are not in a model.

    Attributes
    ----------
    phase_rad, lag_rad : float
        Standard deviation of the torque's phase, and of its change between speeds [rad].
    scale : float
        Standard deviation of a factor on the torque.
    friction : float
        Standard deviation of the constant friction, as a fraction of the torque's RMS.
    load_friction : float
    """

    phase_rad: float
    lag_rad: float
    scale: float
    friction: float
    load_friction: float


# six legs in full coordinates behind 18 drives, 30 to 85 rpm
_IDEAL = ModelError(phase_rad=PHASE_ERROR_RAD, lag_rad=0.01, scale=0.035, friction=0.012, load_friction=0.025)


@attrs.frozen(eq=False)
class TorqueModel:
    """Tables over the crank angle, from 0 in equal steps.

    Attributes
    ----------
    tables : (4, points) array
        Static torque [N m], and by speed [N m s], squared speed [N m s^2], acceleration [kg m^2].
    load : (points,) array
        Torque by a foot load of one newton up [N m/N]; zeros for a mechanism without a toe.
    error : ModelError
    """

    tables: Floats
    load: Floats
    error: ModelError = _IDEAL

    def torque(self, angle: Floats, speed: Floats, acceleration: Floats) -> tuple[Floats, Floats]:
        """Torque [N m] and its derivative by the angle [N m/rad], each (n,)."""
        values, slopes = at_angles(self.tables, angle)
        motion = np.stack([np.ones_like(speed), speed, speed * speed, acceleration])
        return np.asarray((values * motion).sum(axis=0)), np.asarray((slopes * motion).sum(axis=0))

    def load_torque(self, angle: Floats) -> Floats:
        """Torque by a foot load of one newton up (n,) [N m/N]."""
        return np.asarray(at_angles(self.load, angle)[0])


def torque_model(mechanism: Mechanism) -> TorqueModel:
    """Tables of a mechanism.

    Raises
    ------
    AssemblyError
        If the linkage does not close, or the crank does not turn through.
    """
    linkage = build_linkage(mechanism)
    tables = torque_coefficients(linkage, one_cycle(linkage, POINTS, 1.0).q)[0]
    (load,) = load_signatures(linkage, [load_shape(linkage)])
    return TorqueModel(tables, load)

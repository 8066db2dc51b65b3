"""Drive torque of a leg: T = S + w D + w^2 H + a J, each a table over the crank angle."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.tables import POINTS
from leg_wear_monitor.estimate.body_torques import torque_coefficients
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.load import load_signature
from leg_wear_monitor.twin.reference import even_angles
from leg_wear_monitor.twin.torque_reference import TorqueReference

_HARMONICS = 12  # effect of clearances: a mean over a twelfth of a turn shows no more

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


# the ideal leg: six legs in full coordinates behind 18 drives, 30 to 85 rpm (2026-11-24). With clearances: 17
# robots of 0.2 to 0.4 mm behind drives (2026-11-25, docs/appendix/commissioning.md)
_IDEAL = ModelError(phase_rad=PHASE_ERROR_RAD, lag_rad=0.01, scale=0.035, friction=0.012, load_friction=0.025)
_WITH_CLEARANCES = ModelError(
    phase_rad=0.015, lag_rad=0.0085, scale=0.0125, friction=0.010, load_friction=0.012
)


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
    return TorqueModel(tables, load_signature(linkage)[:-1])


def with_clearances(model: TorqueModel, legs: Sequence[TorqueReference]) -> TorqueModel:
    """The model with the effect of clearances on the torque, in simulated legs at one or several cadences.

    Clearances shift the torque's phase, and impacts and friction in the joints take power. Between the
    cadences the change is linear in the speed.

    Parameters
    ----------
    model : TorqueModel
    legs : sequence of TorqueReference
        References whose first legs are used; at least one.
    """
    points = model.tables.shape[1]
    at = np.arange(points) * (TURN / points)
    changes = []
    for leg in legs:
        measured = leg.torque_nm[0].astype(float).mean(axis=0)
        even = even_angles(leg.profile)
        motions = [leg.profile.at(phi) for phi in 0.5 * (even[1:] + even[:-1])]
        angle, speed, acceleration = (
            np.array([getattr(one, name) for one in motions]) for name in ("angle", "speed", "acceleration")
        )
        change = measured - model.torque(angle, speed, acceleration)[0]
        waves = np.fft.rfft(np.interp(at, angle, change, period=TURN))
        waves[_HARMONICS + 1 :] = 0.0
        changes.append(np.fft.irfft(waves, points))
    speeds = np.array([leg.profile.speed for leg in legs])
    by_speed = np.stack([np.ones_like(speeds), speeds], axis=1)[:, : len(speeds)]
    tables = model.tables.copy()
    tables[: by_speed.shape[1]] += np.linalg.lstsq(by_speed, np.array(changes), rcond=None)[0]
    return attrs.evolve(model, tables=tables, error=_WITH_CLEARANCES)

"""Effect of clearances on the angles of further joints: the linear model of `monitor.encoders`.

An encoder on a revolute joint measures the angle from the bushing's body to the journal's. It deviates from
that of the ideal linkage by S_phi(theta) e, linear in the eccentricities e (physics.md section 7). The mean
of e_k over gait cycles is c_k u_k: c_k is the clearance, and u_k(theta) a shape from simulation, of a length
near 1 and along the contact's normal.
"""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.contact.arrays import clearance_settings, compile_contacts
from leg_wear_monitor.dynamics.clearance.basis import Basis
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats, body_names
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism, RevoluteJoint

PHASES = 128  # crank phases per turn: bins of samples, and points of the tables of this module

_ROUNDING = 1.0e-9  # rad/m: a smaller effect on an encoder's angle is rounding of 0
_FINE = 64  # points of the ideal angles per phase


@attrs.frozen(eq=False)
class AngleModel:
    """Angles of m encoders over P phases, and their derivatives by the eccentricities of k clearance joints.

    Attributes
    ----------
    sensors, clearance_joints : tuple of str
        Joints with an encoder; clearance joints.
    angle : (P _FINE, m) array, rad
        Angles of the ideal linkage at equal steps of the crank from 0.
    by_crank : (P, m) array
        Their derivatives by the crank angle at the middle of each phase.
    by_e : (P, m, k, 2) array, rad/m
        S_phi there; exactly 0 where an eccentricity has no effect on an encoder.
    """

    sensors: tuple[str, ...]
    clearance_joints: tuple[str, ...]
    angle: Floats
    by_crank: Floats
    by_e: Floats

    def deviation(self, crank_angle: Floats, angles: Floats) -> Floats:
        """Deviation (n, m) [rad] of measured angles (n, m) from the ideal linkage's at crank angles (n,)."""
        points = len(self.angle)
        at = np.arange(points + 1) * (TURN / points)
        ideal = [np.interp(crank_angle % TURN, at, np.append(one, one[0])) for one in self.angle.T]
        return np.asarray((angles - np.stack(ideal, axis=1) + np.pi) % TURN - np.pi)


def angle_model(mechanism: Mechanism, sensors: Sequence[str]) -> AngleModel:
    """Model of encoders on the revolute joints ``sensors`` of a mechanism.

    Raises
    ------
    ConfigError
        If a sensor is not on a revolute joint.
    AssemblyError
        If the linkage does not close or has a dead point.
    """
    for name in sensors:
        if not isinstance(mechanism.joints.get(name), RevoluteJoint):
            ready = [name for name, joint in mechanism.joints.items() if isinstance(joint, RevoluteJoint)]
            raise ConfigError(
                mechanism.source,
                "joints",
                f"{name!r} is not a revolute joint, expected some of {', '.join(ready)}",
            )
    linkage = build_linkage(mechanism)
    contacts = compile_contacts(
        mechanism, mechanism.clearance_joints, clearance_settings(mechanism, mechanism.clearance_joints)
    )
    motion = one_cycle(linkage, 2 * PHASES, 1.0)
    turns = _differences(mechanism, sensors, motion.q[:, :, 2])
    by_crank = _differences(mechanism, sensors, motion.v[:, :, 2])
    s = Basis(linkage, contacts, motion).s
    rotation = np.concatenate([np.zeros((len(s), 1, s.shape[2])), s[:, 2::3]], axis=1)
    by_e = _differences(mechanism, sensors, rotation).reshape(2 * PHASES, len(sensors), -1, 2)
    by_e[np.abs(by_e) < _ROUNDING] = 0.0
    return AngleModel(
        tuple(sensors), mechanism.clearance_joints, _finer(turns, PHASES * _FINE), by_crank[1::2], by_e[1::2]
    )


def _differences(mechanism: Mechanism, sensors: Sequence[str], of_bodies: Floats) -> Floats:
    """Values (P, m, ...) at the sensors of bodies' values (P, n, ...): journal's minus bushing's body."""
    names = body_names(mechanism)
    pairs = [[names.index(body) for body in mechanism.sides(joint)] for joint in sensors]
    return np.stack([of_bodies[:, j] - of_bodies[:, b] for b, j in pairs], axis=1)


def _finer(table: Floats, points: int) -> Floats:
    """A smooth periodic table (p, m), interpolated to more points by its Fourier series."""
    series = np.fft.rfft(table, axis=0)
    return np.asarray(np.fft.irfft(series, points, axis=0) * (points / len(table)))


def design(model: AngleModel, shape: Floats) -> Floats:
    """Columns (P, m, k + 1 + 2 m) of the regression, for mean shapes (P, k, 2) of the eccentricities.

    The parameters are the clearances [rad/m], the crank encoder's offset, and the offset and the scale error
    of each encoder.
    """
    sensors = len(model.sensors)
    by_clearance = np.einsum("pmkd,pkd->pmk", model.by_e, shape)
    angle = model.angle[_FINE // 2 :: _FINE]
    own = np.zeros((PHASES, sensors, 2 * sensors))
    for i in range(sensors):
        own[:, i, i] = 1.0
        own[:, i, sensors + i] = angle[:, i] - angle[:, i].mean()
    return np.concatenate([by_clearance, -model.by_crank[:, :, None], own], axis=2)

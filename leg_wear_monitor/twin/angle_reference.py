"""Encoder angles of a leg with given clearances, and their derivatives by each clearance, from simulation.

The linear model of `joint_angles` contains the effect of an eccentricity on an angle. A wider clearance also
changes the eccentricities of the other joints, so a regression on the linear model alone attributes the
effect to wrong joints. Therefore the leg is simulated with the expected clearances, and with each of them
widened in turn; the differences are the columns of the regression. This takes seconds and is therefore done
one gait cycle at a time. The simulated crank turns as the measured one: ripple of 3 % under a reference of a
steady crank looks like clearances that are 65 um off.
"""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.contact.arrays import clearance_settings, compile_contacts
from leg_wear_monitor.dynamics.clearance.basis import Basis
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats, body_names
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Mechanism, RevoluteJoint
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters, SimulatedLeg, even_angles
from leg_wear_monitor.twin.torque_reference import LEAST_CLEARANCE_M, Leg, ReferenceRun

# Effect of clearances on the angles of further joints: the linear model of `monitor.encoders`.
#
# An encoder on a revolute joint measures the angle from the bushing's body to the journal's. It deviates from
# the angle of the ideal linkage by S_phi(theta) e, linear in the eccentricities e (physics.md section 7). The
# mean of e_k over gait cycles is c_k u_k: c_k is the clearance, and u_k(theta) a shape from simulation, of a
# length near 1 along the contact's normal.


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
                f"{name!r} is not a revolute joint. Expected some of {', '.join(ready)}",
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
    """Sensor values (P, m, ...) from values of bodies (P, n, ...): journal body minus bushing body."""
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


CYCLES = 48  # simulated cycles per leg: their scatter equals the scatter of as many observed cycles
OPENED_M = 1.5e-4  # increase of each clearance in turn [m]

_PACE = 1  # simulated gait cycles in an evaluation period


@attrs.frozen(eq=False)
class AngleReference:
    """Deviations of a leg with given clearances from the ideal linkage, and their derivatives.

    Attributes
    ----------
    clearance_m : (k,) array
        Mean radial clearances.
    deviation : (P, m) array, rad
        Deviations for these clearances and encoders without errors.
    columns : (P, m, k + 1 + 2 m) array
        Derivatives by clearances [rad/m], the crank encoder's offset, each encoder's offset and scale error.
    cycles : int
        Number of simulated cycles of each leg.
    profile : CrankProfile
        How their crank turned.
    """

    clearance_m: Floats
    deviation: Floats
    columns: Floats
    cycles: int
    profile: CrankProfile


class AngleReferenceRun(ReferenceRun[AngleReference]):
    """Simulates the reference of encoders while evaluation periods pass.

    Parameters
    ----------
    mechanism : Mechanism
        Driven at the speed of the observed gait.
    model : AngleModel
    cycles : int
        Averaged gait cycles of each leg.
    """

    def __init__(self, mechanism: Mechanism, model: AngleModel, cycles: int = CYCLES) -> None:
        super().__init__(mechanism)
        self._model, self._cycles, self._speed = model, cycles, prepare(mechanism).speed

    def begin(self, clearance_m: Floats, depth: Floats, profile: CrankProfile | None = None) -> None:
        """Begin a reference: the expected leg, and each of its joints opened in turn.

        Parameters
        ----------
        clearance_m : (k,) array
            Expected mean clearances.
        depth : (k, 2, N) array
            Wear depths [m], which show where joints are worn.
        profile : CrankProfile, optional
            Motion of the crank; steady by default.
        """
        expected = np.maximum(clearance_m, LEAST_CLEARANCE_M)
        clearances = [expected, *(expected + OPENED_M * np.eye(len(expected)))]
        own = LegParameters.none(self._mechanism)
        self._begin([Leg(own, one) for one in clearances], depth, profile or CrankProfile.steady(self._speed))

    def _so_far(self) -> AngleReference:
        expected, by_e = self._legs[0].clearance_m, self._model.by_e
        means = [at_phases(self._profile, one) for one in self._done]
        deviations = [np.einsum("pmkd,pkd->pm", by_e, mean) for mean in means]
        columns = design(self._model, means[0] / expected[:, None])
        for k in range(len(expected)):
            columns[:, :, k] = (deviations[k + 1] - deviations[0]) / OPENED_M
        return AngleReference(expected, deviations[0], columns, self._cycles, self._profile)

    def _kept(self, leg: SimulatedLeg) -> Floats:
        return leg.eccentricity

    def _cycles_of(self, leg: Leg) -> int:
        return self._cycles

    @property
    def _pace(self) -> int:
        return _PACE


def at_phases(profile: CrankProfile, eccentricity: Floats) -> Floats:
    """Eccentricities (P, k, 2) at the middle of each crank phase, of those after equal steps of time."""
    angle = profile.angles(even_angles(profile))[1:]
    middle = (np.arange(PHASES) + 0.5) * (TURN / PHASES)
    flat = eccentricity.reshape(len(eccentricity), -1)
    found = [np.interp(middle, angle, one, period=TURN) for one in flat.T]
    return np.stack(found, axis=1).reshape(PHASES, *eccentricity.shape[1:])

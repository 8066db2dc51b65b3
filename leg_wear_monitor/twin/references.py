"""Drive torque and encoder angles of a leg with given clearances, by simulation under the crank's own motion.

A clearance shows in where in the gait cycle the torque is rough. That depends on how the crank turns, so the
leg is simulated under the measured profile of the crank: with the clearances that are expected, and with each
of them wider in turn. That takes seconds of a processor, so threads do it while the leg walks on; compiled
code does not hold the interpreter's lock. The number of evaluation periods until a reference is ready depends
only on the legs to simulate: a replay gives the same results as the live monitor.

The reference depends on the leg's masses, lengths and friction as well: legs in which all of them change at
once show the effect of each parameter.
"""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Generic, NamedTuple, TypeVar

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.compiled import numba
from leg_wear_monitor.contact.arrays import clearance_settings, compile_contacts
from leg_wear_monitor.dynamics.clearance.tables import Basis
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import AssemblyError, ConfigError
from leg_wear_monitor.mechanism.arrays import Floats, Ints, body_names
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Mechanism, RevoluteJoint
from leg_wear_monitor.twin.reference import (
    CrankProfile,
    LegParameters,
    LegSimulation,
    even_angles,
)

CADENCES = 6  # number of cadences whose references are stored

# simulated for a leg; twice as many for the expected leg, and half as many for a leg that is far from it
CYCLES = 20
_FAR = 2.5  # factor on a clearance whose effect is large against the scatter of the simulated gait cycles

_PERIODS = 4  # evaluation periods in a commanded gait cycle
# number per evaluation period, a quarter of a gait cycle; a core could simulate 1.5 times as many
SIM_CYCLES_PER_PERIOD = 8
# factors on the expected clearance, for one joint at a time
CLEARANCE_FACTORS = (1.2, 1.35, 1.5, 2.0, 3.0, 5.0, 8.0)

WORN, NARROWER = 1.2, 0.8  # ratio of a clearance to its new value, and a factor on the other clearances

# factors on the mass of one body at a time (half a kilogram on a foot, two on a thigh), and on the friction
# of all joints. Files and ledgers know such legs by their places alone: others would need one for them there
MASSES, FRICTIONS = (0.75, 1.4), (0.6, 1.5, 2.2, 3.2)

# changes of each body's mass and length, and factors on the friction in the joints and on the stiffness of a
# drive that is not rigid (a quarter of its resonance's width): up and down, all of them at once
HEAVIER, LONGER, ROUGHER = 0.02, 0.002, 1.25

_SETTLING = 2  # gait cycles before those that count
LEAST_CLEARANCE_M = 5.0e-5

HalfFloats = NDArray[np.float16]
FoundT = TypeVar("FoundT")


@attrs.frozen(eq=False)
class TorqueReference:
    """Drive torque of simulated legs.

    Attributes
    ----------
    profile : CrankProfile
    clearance_m : (legs, k) array
        Mean radial clearances of each leg; the first leg is the expected one, then each joint is wider in
        turn, all sizes of the first joint before those of the next. The last legs, if their clearances are
        the expected ones, have a changed mass of each body in turn, then a changed friction.
    torque_nm : tuple of (cycles, POINTS) arrays
        Mean drive torque between equal steps of time of a gait cycle, which begins at the profile's angle 0.
    parameters : LegParameters
        Parameters of the expected leg.
    """

    profile: CrankProfile
    clearance_m: Floats
    torque_nm: tuple[HalfFloats, ...]
    parameters: LegParameters

    @property
    def is_whole(self) -> bool:
        """True if all legs are simulated; a partial reference has the torques of the first legs."""
        return len(self.torque_nm) == len(self.clearance_m)

    @property
    def is_of_parameters(self) -> bool:
        """True if its legs differ from the first leg in masses, lengths and friction."""
        return bool((self.clearance_m == self.clearance_m[0]).all())

    @property
    def of_masses(self) -> Ints:
        """Indices (bodies, masses) of legs with a changed mass of a body; (0, masses) without such legs."""
        number = self._of_factors - len(FRICTIONS)
        return (np.arange(max(0, number)) + 1 + self.of_joints.size).reshape(-1, len(MASSES))

    @property
    def of_frictions(self) -> Ints:
        """Indices (1, frictions) of legs with a changed friction; (0, frictions) without such legs."""
        number, legs = min(self._of_factors, len(FRICTIONS)), len(self.clearance_m)
        return np.arange(legs - number, legs).reshape(-1, len(FRICTIONS))

    @property
    def _of_factors(self) -> int:
        """Number of the last legs, which have a changed mass or friction."""
        number = len(MASSES) * len(self.parameters.mass) + len(FRICTIONS)
        are_there = (self.clearance_m[-number:] == self.clearance_m[0]).all() and not self.is_of_parameters
        return number if are_there else 0

    @property
    def of_joints(self) -> Ints:
        """Indices (k, sizes) of legs with a changed clearance of a joint."""
        return np.arange(1, len(self.clearance_m) - self._of_factors).reshape(self.clearance_m.shape[1], -1)

    @property
    def angle(self) -> Floats:
        """Crank angle (POINTS + 1,) [rad] between the steps, from the profile's angle 0 on."""
        return self.profile.angles(even_angles(self.profile))


class Leg(NamedTuple):
    """A leg to be simulated: its parameters, its clearances (k,) [m], and its gait cycles that count."""

    parameters: LegParameters
    clearance_m: Floats
    cycles: int


class ReferenceRun(Generic[FoundT]):
    """Simulates legs while evaluation periods pass: the sensor signals of these legs are its reference.

    Threads simulate some legs ahead of the caller. `advance` waits for them when all are due: its result
    depends on the number of calls alone, and a machine that is busy for a while catches up before. There are
    as many threads as numba may use (NUMBA_NUM_THREADS).

    A subclass has the number ``pace`` of simulated gait cycles in an evaluation period. Its ``_stored`` gives
    the part of a simulated leg that it needs, and ``_so_far`` the reference by these parts.

    Parameters
    ----------
    mechanism : Mechanism

    Attributes
    ----------
    may_be_late : bool
        True if `advance` never waits, since the leg walks on meanwhile: a simulation that is not ready in
        time then comes later.
    """

    may_be_late = False
    pace: int

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._profile, self._depth = CrankProfile.steady(1.0), np.zeros(0)
        self._legs: tuple[Leg, ...] = ()
        self._done: tuple[NDArray[Any], ...] = ()
        self._periods = 0
        self._threads = numba.config.NUMBA_NUM_THREADS
        self._pool = ThreadPoolExecutor(self._threads, "reference")
        self._ahead: list[Future[NDArray[Any] | None]] = []
        self._wanted = object()  # replaced when no caller waits for the simulations of the threads
        self._of_thread = threading.local()

    def _so_far(self) -> FoundT:
        """The reference by the legs that are simulated."""
        raise NotImplementedError

    def _stored(self, torque: Floats, eccentricity: Floats) -> NDArray[Any]:
        """Part of a leg's torque or eccentricities, as in `LegSimulation.simulate`, that is kept."""
        raise NotImplementedError

    @property
    def is_busy(self) -> bool:
        """True if there is a leg to simulate."""
        return len(self._done) < len(self._legs)

    @property
    def profile(self) -> CrankProfile:
        """Motion of the crank in the simulation."""
        return self._profile

    @property
    def progress(self) -> float:
        """Fraction of the gait cycles that are done; 0 where nothing was begun."""
        return min(1.0, self.pace * self._periods / max(1, self._cost(self._legs)))

    @property
    def is_late(self) -> bool:
        """True if all legs are due, but not all are simulated."""
        return self.is_busy and self._cost(self._legs) <= self.pace * self._periods

    @property
    def cycles_left(self) -> float:
        """Commanded gait cycles until all legs are due."""
        periods = -(-self._cost(self._legs) // self.pace) - self._periods
        return max(0, periods) / _PERIODS

    def advance(self, waits: bool = False) -> FoundT | None:
        """Note that an evaluation period has passed; return the reference when it is due.

        A leg that cannot be simulated ends it then without one, or before where the run may be late. The
        caller may wait for each leg.
        """
        if not self.is_busy:
            return None
        self._periods += 1
        is_due = self._cost(self._legs) <= self.pace * self._periods
        can = self._take(waits or (is_due and not self.may_be_late))
        if not can and (is_due or self.may_be_late):
            self._begin((), self._depth, self._profile)
        if not is_due or self.is_busy or not self._legs:
            return None
        self._of_thread = threading.local()  # gives back 20 MB a thread
        return self._so_far()

    def finish(self, progress: Callable[[float], None] = lambda _fraction: None) -> FoundT | None:
        """Simulate the remaining legs immediately; None if one of them cannot be simulated."""
        found = None
        while self.is_busy:
            found = self.advance(waits=True)
            progress(self.progress)
        return found

    def leave(self) -> None:
        """Let the threads stop simulating ahead, because a program's end would wait for them.

        A later call has the legs simulated again.
        """
        for one in self._ahead:
            one.cancel()
        self._ahead, self._wanted = [], object()

    def _begin(
        self, legs: Sequence[Leg], depth: Floats, profile: CrankProfile, done: Sequence[NDArray[Any]] = ()
    ) -> None:
        """Begin to simulate legs; the first legs may be simulated already."""
        self.leave()
        self._legs, self._depth, self._profile = tuple(legs), depth.copy(), profile
        self._done, self._periods = tuple(done), -(-self._cost(legs[: len(done)]) // self.pace)

    @property
    def _due(self) -> int:
        """Number of legs that are due."""
        costs = np.cumsum([_SETTLING + leg.cycles for leg in self._legs])
        return int(np.searchsorted(costs, self.pace * self._periods, side="right"))

    def _take(self, waits: bool) -> bool:
        """Take the legs that are due and simulated, or wait for them, up to the first leg that fails.

        Returns whether all of them can be simulated.
        """
        self._look_ahead()
        while self._ahead and len(self._done) < self._due and (waits or self._ahead[0].done()):
            leg = self._ahead[0].result()
            if leg is None:
                return False
            self._done, self._ahead = (*self._done, leg), self._ahead[1:]
            self._look_ahead()
        return True

    def _look_ahead(self) -> None:
        """Let the threads simulate the next legs; not all, because the end of the program waits for them."""
        simulated = len(self._done) + sum(one.done() for one in self._ahead)
        first = len(self._done) + len(self._ahead)
        for leg in self._legs[first : min(self._due, simulated) + 2 * self._threads]:
            job = self._pool.submit(self._simulated, self._wanted, self._profile, leg, self._depth)
            self._ahead.append(job)

    def _cost(self, legs: Sequence[Leg]) -> int:
        """Gait cycles simulated for some legs, including the cycles in which they settle."""
        return sum(_SETTLING + leg.cycles for leg in legs)

    def _simulated(
        self, wanted: object, profile: CrankProfile, leg: Leg, depth: Floats
    ) -> NDArray[Any] | None:
        """Stored part of a leg; None if it cannot be simulated, or is no longer needed."""
        own = self._of_thread
        if not hasattr(own, "simulation"):
            own.simulation = LegSimulation(self._mechanism)
        try:
            found = own.simulation.simulate(
                profile, leg.parameters, leg.clearance_m, depth, _SETTLING, leg.cycles,
                lambda: self._wanted is wanted,
            )  # fmt: skip
        except AssemblyError:  # the linkage does not close with such lengths
            return None
        return None if found is None else self._stored(*found)


class TorqueReferenceRun(ReferenceRun[TorqueReference]):
    """Simulates a torque reference while evaluation periods pass.

    Parameters
    ----------
    mechanism : Mechanism
    cycles : int, optional
        Gait cycles of each leg; the first leg, which is the expected leg, has twice as many.
    far_cycles : int, optional
        Gait cycles of each leg that is far from the expected one.
    """

    pace = SIM_CYCLES_PER_PERIOD

    def __init__(self, mechanism: Mechanism, cycles: int = CYCLES, far_cycles: int = CYCLES // 2) -> None:
        super().__init__(mechanism)
        self._cycles, self._far_cycles = cycles, far_cycles
        joints = [mechanism.clearances[joint] for joint in mechanism.clearance_joints]
        self._radius = np.array([joint.bushing_radius for joint in joints])
        self._fresh = np.array([joint.radial_clearance for joint in joints])

    def begin(
        self,
        clearance_m: Floats,
        depth: Floats,
        profile: CrankProfile,
        parameters: LegParameters | None = None,
    ) -> None:
        """Begin a reference: the expected leg, then each joint wider, then legs of other factors.

        Parameters
        ----------
        clearance_m : (k,) array
                Expected mean clearances [m].
        depth : (k, 2, N) array
            Wear depths [m], which show where joints are worn.
        profile : CrankProfile
        parameters : LegParameters, optional
            Parameters of the leg; by default the mechanism file's.
        """
        parameters = parameters or LegParameters.none(self._mechanism)
        centre = np.maximum(clearance_m, LEAST_CLEARANCE_M)
        # no clearance is wider than its journal is thick; a worn joint may have got a new part without a word
        widest, is_worn = 0.5 * self._radius, centre > WORN * self._fresh
        narrower = np.where(is_worn, self._fresh, NARROWER * centre)
        legs = [(parameters, centre)]
        for k in range(len(centre)):
            sizes = [min(factor * centre[k], widest[k]) for factor in CLEARANCE_FACTORS]
            for size in [*sizes, narrower[k]] if is_worn.any() else sizes:
                other = centre.copy()
                other[k] = size
                legs.append((parameters, other))
        legs += [(one, centre) for one in _of_factors(parameters)]
        self._begin_legs(legs, depth, profile)

    def begin_expected(
        self, clearance_m: Floats, depth: Floats, profile: CrankProfile, parameters: LegParameters
    ) -> None:
        """Begin only the expected leg; parameters as in `begin`."""
        self._begin_legs([(parameters, np.maximum(clearance_m, LEAST_CLEARANCE_M))], depth, profile)

    def begin_identification(
        self, clearance_m: Floats, depth: Floats, profile: CrankProfile, near: LegParameters
    ) -> None:
        """Begin the leg with given parameters, then legs in which all of them are changed, as in `design`."""
        expected = np.maximum(clearance_m, LEAST_CLEARANCE_M)
        self._begin_legs([(one, expected) for one in _changed(near)], depth, profile, are_near=True)

    def go_on(self, part: TorqueReference, depth: Floats) -> None:
        """Go on with a reference, or an identification, whose first legs were simulated in an earlier run.

        Parameters
        ----------
        part : TorqueReference
        depth : (k, 2, N) array
            Wear depths [m], as in `begin`.
        """
        own = part.parameters
        if part.is_of_parameters:
            parameters = _changed(own)
        else:
            parameters = [own] * (1 + part.of_joints.size)
            parameters += _of_factors(own) if part.of_frictions.size else []
        legs = list(zip(parameters, part.clearance_m, strict=True))
        self._begin_legs(legs, depth, part.profile, part.torque_nm, part.is_of_parameters)

    def _begin_legs(
        self,
        legs: Sequence[tuple[LegParameters, Floats]],
        depth: Floats,
        profile: CrankProfile,
        done: Sequence[HalfFloats] = (),
        are_near: bool = False,
    ) -> None:
        (own, expected), *others = legs
        near = [are_near or (one is own and (wider <= _FAR * expected).all()) for one, wider in others]
        cycles = [2 * self._cycles, *(self._cycles if each else self._far_cycles for each in near)]
        self._begin([Leg(*leg, n) for leg, n in zip(legs, cycles, strict=True)], depth, profile, done)

    @property
    def part(self) -> TorqueReference | None:
        """The legs of a reference that are due so far; None if no leg or all legs are due."""
        self._take(waits=not self.may_be_late)
        return self._so_far() if self._done and self.is_busy else None

    def _so_far(self) -> TorqueReference:
        clearance_m = np.array([leg.clearance_m for leg in self._legs])
        return TorqueReference(self._profile, clearance_m, self._done, self._legs[0].parameters)

    def _stored(self, torque: Floats, eccentricity: Floats) -> HalfFloats:
        return torque.astype(np.float16)


def design(parameters: int) -> Floats:
    """Levels (legs, parameters) of parameters in simulated legs: 0 in the first, then all at once, -1 or 1.

    All legs show the effect of each parameter: its scatter from their chaotic motion is a thirty-second of
    the scatter with one leg per parameter (Hotelling, Annals of Mathematical Statistics 15 (1944), 297). As
    each leg has its opposite, the joint effect of two parameters cancels.
    """
    levels: Floats = np.ones((1, 1))
    while len(levels) < parameters:  # Sylvester's matrices: all columns are orthogonal
        levels = np.block([[levels, levels], [levels, -levels]])
    levels = levels[:, :parameters]
    return np.vstack([np.zeros(parameters), levels, -levels])


def levels_of(near: LegParameters) -> Floats:
    """Levels, as in `design`, of masses, lengths and friction."""
    return design(2 * len(near.mass) + 1)


def _changed(near: LegParameters) -> list[LegParameters]:
    """The given parameters, then the parameters of legs with other masses, lengths and friction."""
    bodies, legs = len(near.mass), []
    for levels in levels_of(near):
        mass, length, friction = np.split(levels, [bodies, 2 * bodies])
        changed = attrs.evolve(
            near,
            mass=near.mass + HEAVIER * mass,
            length=near.length + LONGER * length,
            friction=near.friction * ROUGHER ** friction.item(),
        )
        legs.append(changed)
    return legs


def _of_factors(near: LegParameters) -> list[LegParameters]:
    """Parameters with a changed mass of each body in turn, then with a changed friction."""
    masses = [near.mass * factor**one for one in np.eye(len(near.mass)) for factor in MASSES]
    changed = [attrs.evolve(near, mass=mass) for mass in masses]
    return changed + [attrs.evolve(near, friction=near.friction * factor) for factor in FRICTIONS]


# Effect of clearances on the angles of further joints: the linear model of `monitor.encoders`.
#
# An encoder on a revolute joint measures the angle from the bushing's body to the journal's. It deviates from
# the angle of the ideal linkage by S_phi(theta) e, linear in the eccentricities e (physics.md section 7). The
# mean of e_k over gait cycles is c_k u_k: c_k is the clearance, and u_k(theta) a shape from simulation, of a
# length near 1 along the contact's normal.
#
# The linear model of `AngleModel` contains the effect of an eccentricity on an angle. A wider clearance also
# changes the eccentricities of the other joints, so a regression on the linear model alone attributes the
# effect to wrong joints. Therefore the leg is simulated with the expected clearances, and with each of them
# widened in turn; the differences are the columns of the regression. This takes seconds and is therefore done
# one gait cycle at a time. The simulated crank turns as the measured one: ripple of 3 % under a reference of
# a steady crank looks like clearances that are 65 um off.


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


def angle_columns(model: AngleModel, shape: Floats) -> Floats:
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


ANGLE_CYCLES = 48  # simulated cycles per leg: their scatter equals the scatter of as many observed cycles
OPENED_M = 1.5e-4  # increase of each clearance in turn [m]


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

    pace = 1

    def __init__(self, mechanism: Mechanism, model: AngleModel, cycles: int = ANGLE_CYCLES) -> None:
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
        legs = [Leg(own, one, self._cycles) for one in clearances]
        self._begin(legs, depth, profile or CrankProfile.steady(self._speed))

    def _so_far(self) -> AngleReference:
        expected, by_e = self._legs[0].clearance_m, self._model.by_e
        means = [at_phases(self._profile, one) for one in self._done]
        deviations = [np.einsum("pmkd,pkd->pm", by_e, mean) for mean in means]
        columns = angle_columns(self._model, means[0] / expected[:, None])
        for k in range(len(expected)):
            columns[:, :, k] = (deviations[k + 1] - deviations[0]) / OPENED_M
        return AngleReference(expected, deviations[0], columns, self._cycles, self._profile)

    def _stored(self, torque: Floats, eccentricity: Floats) -> Floats:
        return eccentricity


def at_phases(profile: CrankProfile, eccentricity: Floats) -> Floats:
    """Eccentricities (P, k, 2) at the middle of each crank phase, of those after equal steps of time."""
    angle = profile.angles(even_angles(profile))[1:]
    middle = (np.arange(PHASES) + 0.5) * (TURN / PHASES)
    flat = eccentricity.reshape(len(eccentricity), -1)
    found = [np.interp(middle, angle, one, period=TURN) for one in flat.T]
    return np.stack(found, axis=1).reshape(PHASES, *eccentricity.shape[1:])

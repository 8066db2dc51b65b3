"""A simulated leg: its parameters, how its crank turns, and its drive torque and eccentricities.

References are built from simulated legs: they hold the sensor signals of a leg with given clearances.
"""

from collections.abc import Callable, Iterator, Sequence

import attrs
import numpy as np

from leg_wear_monitor.compiled.kernel import entry
from leg_wear_monitor.dynamics.clearance.advance import ADVANCE
from leg_wear_monitor.dynamics.clearance.model import ClearanceModel, Coupling, coupling_of, rigid_coupling
from leg_wear_monitor.dynamics.clearance.stepper import (
    INTERVALS,
    ClearanceStepper,
    LoadedTable,
    loaded_tables,
    put_force,
)
from leg_wear_monitor.dynamics.clearance.tables import POINTS as TABLE_POINTS
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables, build_tables
from leg_wear_monitor.dynamics.run import DONE, TORQUE, CrankMotion, Setup, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import with_toe_force
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism

# A leg whose masses, lengths and friction differ a little from the mechanism file.


# standard deviation of a body's mass about the file's mass, if nothing else is known
MASS_TOLERANCE = 0.05


# damping ratio of the crank on its coupling, with the mean inertia of the ideal leg: belts and elastomer
# couplings lose 30 to 60 % of the energy per oscillation, which is 4 pi times this ratio
COUPLING_DAMPING = 0.05


# Factor by which a leg may differ from its file, and the largest friction coefficient of a mechanism file.
_MOST, _MOST_COEFFICIENT = 2.0, 2.0


@attrs.frozen
class LegParameters:
    """Factors on the parameters of a mechanism, the compliance of its drive, and the ground under its toe.

    Attributes
    ----------
    mass, length : (bodies,) arrays
        Factors on bodies, in the order of the file. A heavier body has the same shape; a longer one is scaled
        in all directions and has the same mass.
    friction : float
        Factor on the friction coefficients of all clearance joints.
    compliance : float
        Compliance between the measured crank angle and the crank [rad/(N m)], at the crank; 0 if it is rigid.
    damping : float
        Damping of the crank on a compliant drive, over the critical damping with the mean inertia of the
        ideal leg.
    load : (PHASES, 2) array
        Mean force of the ground on the toe at equal steps of the crank angle from 0 [N]; (0, 2) without one.
    load_sigma : float
        Standard deviation of the load's size, as a fraction of it; ignored when legs are compared.
    """

    mass: Floats = attrs.field(eq=attrs.cmp_using(eq=np.array_equal))
    length: Floats = attrs.field(eq=attrs.cmp_using(eq=np.array_equal))
    friction: float = 1.0
    compliance: float = 0.0
    damping: float = COUPLING_DAMPING
    load: Floats = attrs.field(factory=lambda: np.zeros((0, 2)), eq=attrs.cmp_using(eq=np.array_equal))
    load_sigma: float = attrs.field(default=0.0, eq=False)

    @classmethod
    def none(cls, mechanism: Mechanism) -> "LegParameters":
        """Factors of the unchanged mechanism."""
        return cls(np.ones(len(mechanism.bodies)), np.ones(len(mechanism.bodies)))

    @property
    def in_air(self) -> "LegParameters":
        """Parameters of the leg without a load."""
        return attrs.evolve(self, load=np.zeros((0, 2)))

    def is_possible(self, mechanism: Mechanism) -> bool:
        """True if a leg can have these values; the torque of a leg never leads to others."""
        bodies = np.append(self.mass, self.length)
        is_near = bool(((bodies >= 1.0 / _MOST) & (bodies <= _MOST)).all())
        coefficients = [self.friction * one.friction.coefficient for one in mechanism.clearances.values()]
        return is_near and self.friction > 0.0 and all(one <= _MOST_COEFFICIENT for one in coefficients)

    def applied(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism with these factors; the compliance is not part of the mechanism."""
        bodies = {}
        for (name, body), mass, length in zip(mechanism.bodies.items(), self.mass, self.length, strict=True):
            bodies[name] = attrs.evolve(
                body,
                mass=float(mass * body.mass),
                inertia=float(mass * length**2 * body.inertia),
                com=_scaled(body.com, length),
                points={point: _scaled(place, length) for point, place in body.points.items()},
            )
        clearances = {
            joint: attrs.evolve(
                one,
                friction=attrs.evolve(one.friction, coefficient=self.friction * one.friction.coefficient),
            )
            for joint, one in mechanism.clearances.items()
        }
        leg = attrs.evolve(mechanism, bodies=bodies, clearances=clearances)
        return with_toe_force(leg, self.load) if self.load.size else leg


def _scaled(place: tuple[float, float], factor: float) -> tuple[float, float]:
    return (float(factor * place[0]), float(factor * place[1]))


# How a crank turns in a gait cycle: its mean speed and its ripple, from samples of its angle.


# fraction of the mean speed: a crank motion that differs by more is not compared. At 57 rpm a leg looks as if
# its joints were 0.03 to 0.09 mm wider than at 60, and a clearance changes other phases (diagnosis.md)
UNLIKE = 0.015

# fraction of a sensor's period: times in whole milliseconds, as tables have them, move samples at 200 Hz by
# up to a tenth of it, so that the speed of the same crank differs by 2 % from gait cycle to gait cycle
_COARSE = 0.01
_LOST = 1.5  # steps: in a longer time between two samples, some were lost

HARMONICS = 8  # harmonics of a turn; faster parts are mostly noise of the encoder


@attrs.frozen(eq=False)
class CrankProfile:
    """Angle of a crank that turns in the same way in each gait cycle.

    The angle is phi + sum over h of ``cosine[h - 1]`` cos(h phi) + ``sine[h - 1]`` sin(h phi), phi the angle
    of a crank that turns at the mean speed.

    Attributes
    ----------
    speed : float
        Mean speed [rad/s], negative for a crank that turns clockwise.
    cosine, sine : (HARMONICS,) arrays
        Ripple [rad].
    """

    speed: float
    cosine: Floats
    sine: Floats

    @classmethod
    def steady(cls, speed: float) -> "CrankProfile":
        """Profile of a crank that turns at a constant speed [rad/s]."""
        return cls(speed, np.zeros(HARMONICS), np.zeros(HARMONICS))

    @property
    def cadence_rpm(self) -> float:
        """Mean speed [rpm]."""
        return 60.0 * self.speed / TURN

    def at(self, phi: float) -> CrankMotion:
        """Motion at an angle phi [rad] of the evenly turning crank."""
        h = np.arange(1.0, HARMONICS + 1.0)
        c, s = np.cos(h * phi), np.sin(h * phi)
        return CrankMotion(
            float(phi + self.cosine @ c + self.sine @ s),
            float(self.speed * (1.0 + h @ (self.sine * c - self.cosine * s))),
            float(-(self.speed**2) * (h**2 @ (self.cosine * c + self.sine * s))),
        )

    def angles(self, phi: Floats) -> Floats:
        """Crank angles (n,) [rad] at angles (n,) of the evenly turning crank."""
        h = np.outer(phi, np.arange(1.0, HARMONICS + 1.0))
        return np.asarray(phi + np.cos(h) @ self.cosine + np.sin(h) @ self.sine)

    def departure(self, other: "CrankProfile") -> float:
        """Largest difference of the speeds in a turn, as a fraction of the mean speed."""
        own, others = self._speeds(), other._speeds()
        return float(np.abs(own - others).max() / abs(other.speed))

    def is_like(self, other: "CrankProfile") -> bool:
        """True if torques under the two motions can be compared."""
        return self.departure(other) <= UNLIKE

    def _speeds(self) -> Floats:
        """Speeds [rad/s] at some phases of a turn."""
        h = np.arange(1.0, HARMONICS + 1.0)
        phases = np.outer(np.arange(8 * HARMONICS) * (TURN / (8 * HARMONICS)), h)
        ripple = np.cos(phases) @ (h * self.sine) - np.sin(phases) @ (h * self.cosine)
        return np.asarray(self.speed * (1.0 + ripple))


def cycle_profile(time_s: Floats, angle: Floats, duration_s: float) -> CrankProfile:
    """Profile of one gait cycle, by least squares.

    Coarse times, such as whole milliseconds, are evened if the angles then fit better.

    Parameters
    ----------
    time_s, angle : (n,) arrays
        Times since the crank passed its zero [s] and continuous crank angles [rad], in order.
    duration_s : float
        Time until the crank passes its zero again.
    """
    stamped, rest, _ = _fitted(time_s, angle, duration_s)
    even_s = _evened(time_s)
    if even_s is None:
        return stamped
    _, _, longer = _fitted(even_s, angle, duration_s, is_whole=False)  # its passages are as coarse
    even, rest_of_even, _ = _fitted(even_s, angle, duration_s * longer)
    return even if rest_of_even < rest else stamped


def _fitted(
    time_s: Floats, angle: Floats, duration_s: float, is_whole: bool = True
) -> tuple[CrankProfile, float, float]:
    """Profile of angles at some times, the RMS of its residual [rad], and a factor on the duration.

    The factor is 1 if the gait cycle is whole, that is, if its duration is known.
    """
    speed = float(np.copysign(TURN / duration_s, angle[-1] - angle[0]))
    phi = speed * time_s
    h = np.arange(1.0, HARMONICS + 1.0)
    columns = np.hstack([np.ones((len(phi), 1)), np.cos(np.outer(phi, h)), np.sin(np.outer(phi, h))])
    if not is_whole:
        columns = np.hstack([columns, phi[:, None]])
    found = np.linalg.lstsq(columns, angle - phi, rcond=None)[0]
    rest = float(np.sqrt(np.mean((angle - phi - columns @ found) ** 2)))
    # ripple counts from angle 0 of the evenly turning crank, which is not where the crank passes its zero
    turned = found[0] - TURN * np.round(found[0] / TURN)
    sines = slice(1 + HARMONICS, 1 + 2 * HARMONICS)
    ripple = (found[1 : 1 + HARMONICS] - 1j * found[sines]) * np.exp(-1j * h * turned)
    profile = CrankProfile(speed, np.asarray(ripple.real), np.asarray(-ripple.imag))
    return profile, rest, 1.0 if is_whole else 1.0 / (1.0 + float(found[-1]))


def _evened(time_s: Floats) -> Floats | None:
    """Times (n,) of evenly spaced samples, except lost samples; None unless given times are coarse."""
    steps = np.diff(time_s)
    period = float(np.mean(steps[steps <= _LOST * np.median(steps)]))
    if np.gcd.reduce(np.rint(1.0e9 * steps).astype(np.int64)) < 1.0e9 * _COARSE * period:
        return None
    number = np.concatenate([[0.0], np.cumsum(np.round(steps / period))])
    even_s = np.asarray(np.polyval(np.polyfit(number, time_s, 1), number))
    return even_s if np.abs(even_s - time_s).max() > _COARSE * period else None


def mean_profile(profiles: Sequence[CrankProfile]) -> CrankProfile:
    """Mean of the profiles of several gait cycles."""
    return CrankProfile(
        float(np.mean([one.speed for one in profiles])),
        np.asarray(np.mean([one.cosine for one in profiles], axis=0)),
        np.asarray(np.mean([one.sine for one in profiles], axis=0)),
    )


# Simulation of this leg without wear, the same in each gait cycle.


POINTS = INTERVALS // 4  # points per gait cycle: whole intervals of the stepper

# scatter of the ground's force from step to step, of its size and of its time in a gait cycle
_SIZE, _TIMING, _SEED = 0.1, 0.02, 20261125

_advance = ADVANCE.call


@entry
def simulate_cycles(
    advance_address,
    model,
    feeds_back,
    state,
    pieces,
    period,
    turn,
    first,
    settling,
    statistics,
    work,
    polynomial,
    out_torque,
    out_eccentricity,
):
    """Simulate gait cycles from the one with the number ``first``.

    ``pieces`` (POINTS, 7) are the crank's motion in cycle 0, and a cycle takes ``period`` [s] for ``turn``
    [rad]. ``out_torque`` (cycles, POINTS) [N m] gets the mean torques between equal times; to
    ``out_eccentricity`` (POINTS, 2 k) [m] those at these times are added, except for the first ``settling``
    cycles. Returns DONE, or the reason for stopping.
    """
    cycles, points = out_torque.shape
    impulse = statistics.drive_integral[TORQUE]
    for cycle in range(first, first + cycles):
        for i in range(points):
            for j in range(polynomial.shape[0]):
                polynomial[j] = pieces[i, j]
            polynomial[0] += cycle * period
            polynomial[1] += cycle * turn
            # a little past the end of an interval, or rounding could leave it out
            end = (cycle * points + i + 1.01) * period / points
            status, _ = _advance(
                advance_address, (model, feeds_back, state, polynomial, end, statistics, work)
            )
            if status != DONE:
                return status
            before, impulse = impulse, statistics.drive_integral[TORQUE]
            out_torque[cycle - first, i] = (impulse - before) * (points / period)
            if cycle >= settling:
                for j in range(out_eccentricity.shape[1]):
                    out_eccentricity[i, j] += state.e[j]
    return DONE


class LegSimulation:
    """Simulates legs without wear, in order.

    Parameters
    ----------
    mechanism : Mechanism
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._parameters: LegParameters | None = None
        self._tables: ClearanceTables | None = None
        self._loaded: list[LoadedTable] | None = None

    def simulate(
        self,
        profile: CrankProfile,
        parameters: LegParameters,
        clearance_m: Floats,
        depth: Floats,
        settling: int,
        cycles: int,
        wanted: Callable[[], bool] = lambda: True,
    ) -> tuple[Floats, Floats] | None:
        """Simulate a leg from the start.

        Parameters
        ----------
        profile : CrankProfile
        parameters : LegParameters
        clearance_m : (k,) array
            Mean clearances [m].
        depth : (k, 2, N) array
            Wear depths [m], which show where joints are worn.
        settling : int
            Gait cycles before those that count.
        cycles : int
        wanted : callable
            Returns True to continue; called after each gait cycle; may be called in any thread.

        Returns
        -------
        torque : (cycles, POINTS) array
            Mean drive torque [N m] between equal steps of time of a gait cycle.
        eccentricity : (POINTS, k, 2) array
            Mean over the gait cycles at the end of each step [m]. The result is None if the leg cannot be
            simulated, or is no longer needed.

        Raises
        ------
        AssemblyError
            If its bodies do not close.
        """
        if parameters != self._parameters:
            self._prepare(parameters)
        period, turn = TURN / abs(profile.speed), float(np.copysign(TURN, profile.speed))
        motions, step = [profile.at(phi) for phi in even_angles(profile)], period / POINTS
        pieces = np.array([quintic(i * step, motions[i], step, motions[i + 1]) for i in range(POINTS)])
        clearance, worn = worn_to(self._fresh, depth, clearance_m)
        self._setup.contacts.clearance[:] = clearance
        self._setup.surfaces.depth[:] = worn
        stepper = ClearanceStepper(self._setup, period / INTERVALS, tables=self._tables)
        coupling = drive_coupling(self._setup, stepper.model, parameters)
        stepper.model = stepper.model._replace(coupling=coupling)
        stepper.init(motions[0].angle, motions[0].speed)
        statistics = new_run_statistics(len(self._mechanism.joints))
        polynomial, torque = np.empty(7), np.empty((settling + cycles, POINTS))
        eccentricity = np.zeros((POINTS, len(stepper.state.e)))
        address = stepper.advance_address(polynomial, statistics)
        for cycle in self._each_under_its_load(parameters.load, len(torque)):
            status = simulate_cycles(
                address, stepper.model, self._setup.surfaces.feeds_back, stepper.state, pieces, period, turn,
                cycle, settling, statistics, stepper.work, polynomial, torque[cycle, None], eccentricity,
            )  # fmt: skip
            if status != DONE or not wanted():
                return None
        if not np.abs(torque).max() < np.finfo(np.float16).max:  # the stored value; it may be NaN
            return None
        return torque[settling:], eccentricity.reshape(POINTS, -1, 2) / cycles

    def _each_under_its_load(self, load: Floats, cycles: int) -> Iterator[int]:
        """Number of each gait cycle, which selects the load on the leg.

        With the same force in each step, all impacts would have the same phases.
        """
        if self._loaded is None:
            yield from range(cycles)
            return
        random, place = np.random.default_rng(_SEED), np.arange(len(load)) / len(load)
        phase = np.arange(TABLE_POINTS) / TABLE_POINTS
        for cycle in range(cycles):
            factor, late = 1.0 + _SIZE * random.standard_normal(), _TIMING * random.standard_normal()
            force = [factor * np.interp(phase - late, place, one, period=1.0) for one in load.T]
            put_force(self._loaded, np.stack(force, axis=1))
            yield cycle

    def _prepare(self, parameters: LegParameters) -> None:
        """Prepare the simulation of legs with given masses, lengths and friction."""
        self._parameters = self._loaded = self._tables = None  # 18 MB, while the next step needs 50
        self._setup = prepare(parameters.in_air.applied(self._mechanism), wear=True)
        linkage, contacts = self._setup.linkage, self._setup.contacts
        contacts.wear_coefficient[:] = 0.0
        self._fresh = contacts.clearance.copy()
        if parameters.load.size:
            self._tables, self._loaded = loaded_tables(linkage, contacts)
        else:
            self._tables = build_tables(linkage, contacts)
        self._parameters = parameters


def drive_coupling(setup: Setup, model: ClearanceModel, parameters: LegParameters) -> Coupling:
    """Coupling of a leg whose drive has a compliance."""
    if parameters.compliance == 0.0:
        return rigid_coupling()
    joints, stiffness = len(setup.clearance_joints), 1.0 / parameters.compliance
    return coupling_of(model.tables, joints, model.interval, stiffness, parameters.damping)


def even_angles(profile: CrankProfile) -> Floats:
    """Angles (POINTS + 1,) [rad] of the evenly turning crank at equal steps of a gait cycle."""
    return np.linspace(0.0, np.copysign(TURN, profile.speed), POINTS + 1)


_LEAST_WEAR_M = 5.0e-6  # least mean wear whose profile is scaled; with less, a joint is widened evenly


def worn_to(fresh: Floats, depth: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Clearances when new (k,) and wear depths (k, 2, N) that give the target (k,) mean clearances [m].

    The wear profile of a worn joint is scaled, to none where it is to be new; a joint without a profile is
    widened evenly.
    """
    worn, wanted = depth.sum(axis=1).mean(axis=1), np.maximum(target - fresh, 0.0)
    scale = np.where(worn > _LEAST_WEAR_M, wanted / np.maximum(worn, _LEAST_WEAR_M), 1.0)
    return target - scale * worn, scale[:, None, None] * depth

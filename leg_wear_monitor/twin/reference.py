"""Encoder angles of a leg with given clearances, and their derivatives by each clearance, from simulation.

The linear model of `joint_angles` contains the effect of an eccentricity on an angle. A wider clearance also
changes the eccentricities of the other joints, so a regression on the linear model alone attributes the
effect to wrong joints. Therefore the leg is simulated with the expected clearances, and with each of them
widened in turn; the differences are the columns of the regression. This takes seconds and is therefore done
one gait cycle at a time. The simulated crank turns as the measured one: ripple of 3 % under a reference of a
steady crank looks like clearances that are 65 um off.
"""

from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.contact.arrays import clearance_settings, compile_contacts
from leg_wear_monitor.dynamics.clearance.basis import Basis
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper, Snapshot
from leg_wear_monitor.dynamics.run import DONE, CrankMotion, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats, body_names
from leg_wear_monitor.mechanism.person import with_toe_force
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Mechanism, RevoluteJoint

# Effect of clearances on the angles of further joints: the linear model of `monitor.encoders`.
#
# An encoder on a revolute joint measures the angle from the bushing's body to the journal's. It deviates from
# that of the ideal linkage by S_phi(theta) e, linear in the eccentricities e (physics.md section 7). The mean
# of e_k over gait cycles is c_k u_k: c_k is the clearance, and u_k(theta) a shape from simulation, of a
# length near 1 and along the contact's normal.


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


# A leg whose masses, lengths and friction are not quite those of the mechanism file.


MASS_TOLERANCE = (
    0.05  # standard deviation of a body's mass about that of the file, where nothing else is known
)


# of the crank on its coupling, with the mean inertia of the ideal leg: belts and elastomer couplings lose 30
# to 60 % of the energy of an oscillation in it, 4 pi times as much
COUPLING_DAMPING = 0.05


@attrs.frozen
class LegParameters:
    """Factors on the parameters of a mechanism, the compliance of its drive, and the ground under its toe.

    Attributes
    ----------
    mass, length : (bodies,) arrays
        On bodies, in the order of the file. A heavier body has the same shape; a longer one is scaled in all
        directions and has the same mass.
    friction : float
        On the friction coefficients of all clearance joints.
    compliance : float
        Of what is between the measured crank angle and the crank [rad/(N m)], at the crank; 0 if it is rigid.
    damping : float
        Of the crank on a compliant drive, over the critical one with the mean inertia of the ideal leg.
    load : (PHASES, 2) array
        Mean force of the ground on the toe at equal steps of the crank angle from 0 [N]; (0, 2) without one.
    load_sigma : float
        Standard deviation of its size, as a fraction of it; no part of the leg, which is equal with any.
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
        """Factors of the mechanism as it is."""
        return cls(np.ones(len(mechanism.bodies)), np.ones(len(mechanism.bodies)))

    @property
    def in_air(self) -> "LegParameters":
        """Those of the leg without a load."""
        return attrs.evolve(self, load=np.zeros((0, 2)))

    def of_bodies(self, names: Sequence[str], mechanism: Mechanism) -> "LegParameters":
        """These, of bodies in this order, in the order of the mechanism."""
        order = [names.index(name) for name in mechanism.bodies]
        return attrs.evolve(self, mass=self.mass[order], length=self.length[order])

    def applied(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism with these factors; the compliance is none of it."""
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


# of the mean speed: a crank that turns otherwise by more is not compared. At 57 rpm a leg looks as if its
# joints were 0.03 to 0.09 mm wider than at 60, and what a clearance changes is in other phases (diagnosis.md)
UNLIKE = 0.015

# of a sensor's period: times in whole milliseconds, as tables have them, move samples at 200 Hz by up to a
# tenth of it, so that the speed of the same crank differs by 2 % from gait cycle to gait cycle
_COARSE = 0.01
_LOST = 1.5  # steps: in a longer time between two samples, some were lost

HARMONICS = 8  # of a turn; what is faster is noise of the encoder more than motion of the crank


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
        """Whether a torque under this motion can be compared with one under another."""
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
    """Profile of angles at some times, the RMS of what it leaves over [rad], and a factor on the duration.

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
    """Times (n,) of samples that come evenly, but for lost ones; None where those given are not coarse."""
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


CYCLES = 48  # simulated cycles of each leg: the scatter equals that of as many observed cycles
OPENED_M = 1.5e-4  # increase of each clearance in turn [m]

_LEAST_CLEARANCE_M = 5.0e-5
_LEAST_WEAR_M = 5.0e-6  # least mean wear whose profile is scaled; with less, a joint is widened evenly


@attrs.frozen(eq=False)
class Reference:
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


class ReferenceSnapshot(NamedTuple):
    """Complete state of a `ReferenceRun` as plain arrays and numbers."""

    profile: CrankProfile
    clearance_m: Floats
    depth: Floats
    total: Floats
    means: tuple[Floats, ...]
    cycle: int
    stepper: Snapshot | None


class ReferenceRun:
    """Computes a reference, one gait cycle at a time.

    Parameters
    ----------
    mechanism : Mechanism
        Driven at the speed of the observed gait.
    model : AngleModel
    cycles : int
        Averaged gait cycles of each leg, after a first one that is left out.
    """

    def __init__(self, mechanism: Mechanism, model: AngleModel, cycles: int = CYCLES) -> None:
        self._setup, self._model, self._cycles = prepare(mechanism, wear=True), model, cycles
        self._setup.contacts.wear_coefficient[:] = 0.0
        self._fresh = self._setup.contacts.clearance.copy()
        self._tables = ClearanceStepper(self._setup).model.tables
        self._statistics = new_run_statistics(len(mechanism.joints))
        self._stepper: ClearanceStepper | None = None
        self._target, self._depth = self._fresh, self._setup.surfaces.depth.copy()
        self._total, self._cycle = np.zeros(0), 0
        self._means: tuple[Floats, ...] = ()
        self._use(CrankProfile.steady(self._setup.speed))

    @property
    def is_busy(self) -> bool:
        """Whether a reference is in progress."""
        return self._stepper is not None

    def begin(self, clearance_m: Floats, depth: Floats, profile: CrankProfile | None = None) -> None:
        """Begin a reference.

        Parameters
        ----------
        clearance_m : (k,) array
            Mean clearances.
        depth : (k, 2, N) array
            Wear depths [m], which show where joints are worn.
        profile : CrankProfile, optional
            That of a steady crank by default.
        """
        self._use(profile or CrankProfile.steady(self._setup.speed))
        self._target, self._depth = np.maximum(clearance_m, _LEAST_CLEARANCE_M), depth.copy()
        self._means = ()
        self._begin_leg()

    def advance(self) -> Reference | None:
        """Simulate one gait cycle.

        Returns
        -------
        Reference or None
            The reference after its last cycle, else None. If the motion of a leg diverges, the computation
            ends without a reference.
        """
        if self._stepper is None:
            return None
        begin_s = self._cycle * self._times[-1]
        turned = np.copysign(TURN * self._cycle, self._profile.speed)
        for i in range(PHASES):
            if self._cycle:  # the first cycle is left out
                self._total[i] += self._stepper.eccentricity.ravel()
            piece = self._pieces[i].copy()
            piece[0] += begin_s
            piece[1] += turned
            status, _ = self._stepper.advance(piece, begin_s + self._times[i + 1], self._statistics)
            if status != DONE:
                self._stepper = None
                return None
        self._cycle += 1
        if self._cycle <= self._cycles:
            return None
        self._means = (*self._means, _by_angle(self._total / self._cycles, self._setup.speed))
        if len(self._means) <= len(self._fresh):
            self._begin_leg()
            return None
        self._stepper = None
        return self._reference()

    def snapshot(self) -> ReferenceSnapshot:
        """A copy of the whole state."""
        stepper = self._stepper.snapshot() if self._stepper else None
        return ReferenceSnapshot(
            self._profile, self._target, self._depth, self._total.copy(), self._means, self._cycle, stepper
        )

    def restore(self, snapshot: ReferenceSnapshot) -> None:
        """Restore a snapshot of a run of the same mechanism and model; it continues bit-identically."""
        self._use(snapshot.profile)
        self._target, self._depth, self._means = snapshot.clearance_m, snapshot.depth, snapshot.means
        self._stepper = None
        if snapshot.stepper is not None:
            self._begin_leg().restore(snapshot.stepper)
        self._total, self._cycle = snapshot.total.copy(), snapshot.cycle

    def _begin_leg(self) -> ClearanceStepper:
        """Start the next leg: first with the target clearances, then with each of them widened in turn."""
        target = self._opened(len(self._means))
        clearance, depth = worn_to(self._fresh, self._depth, target)
        self._setup.contacts.clearance[:] = clearance
        self._setup.surfaces.depth[:] = depth
        self._stepper = ClearanceStepper(self._setup, tables=self._tables)
        self._stepper.init(self._start.angle, self._start.speed)
        self._total, self._cycle = np.zeros((PHASES, 2 * len(self._fresh))), 0
        return self._stepper

    def _use(self, profile: CrankProfile) -> None:
        """Prepare the drive between the middles of the phases, in a turn."""
        self._profile = profile
        sign = np.copysign(1.0, profile.speed)
        wanted = 0.5 * TURN / PHASES + sign * np.arange(PHASES + 1) * (TURN / PHASES)
        even = sign * np.linspace(-TURN, 2.0 * TURN, 3 * PHASES * _FINE + 1)
        phi = np.interp(sign * wanted, sign * profile.angles(even), even)
        self._times = (phi - phi[0]) / profile.speed
        motions = [profile.at(at) for at in phi]
        steps = np.diff(self._times)
        self._start = motions[0]
        self._pieces = np.array(
            [quintic(self._times[i], motions[i], steps[i], motions[i + 1]) for i in range(PHASES)]
        )

    def _opened(self, leg: int) -> Floats:
        """Clearances (k,) [m]: those of the target for leg 0, with joint k widened for leg k + 1."""
        target = self._target.copy()
        target[leg - 1 : leg] += OPENED_M
        return target

    def _reference(self) -> Reference:
        joints = len(self._fresh)
        by_e = self._model.by_e
        deviations = [np.einsum("pmkd,pkd->pm", by_e, mean) for mean in self._means]
        columns = design(self._model, self._means[0] / self._target[:, None])
        for k in range(joints):
            columns[:, :, k] = (deviations[k + 1] - deviations[0]) / OPENED_M
        return Reference(self._target, deviations[0], columns, self._cycles, self._profile)


def _by_angle(mean: Floats, speed: float) -> Floats:
    """Means (P, k, 2) in the order of the crank angle, for either direction of rotation."""
    if speed < 0.0:
        mean = np.roll(mean[::-1], 1, axis=0)
    return np.asarray(mean.reshape(PHASES, -1, 2))


def worn_to(fresh: Floats, depth: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Clearances when new (k,) and wear depths (k, 2, N) that give the target (k,) mean clearances [m].

    The wear profile of a worn joint is scaled; a joint without a profile is widened evenly.
    """
    worn, wanted = depth.sum(axis=1).mean(axis=1), target - fresh
    scale = np.where((worn > _LEAST_WEAR_M) & (wanted > 0.0), wanted / np.maximum(worn, _LEAST_WEAR_M), 1.0)
    return target - scale * worn, scale[:, None, None] * depth

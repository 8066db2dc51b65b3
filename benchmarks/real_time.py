"""Real-time factor of the leg's models, compared with Exudyn and SciPy's solve_ivp.

    pip install .[bench]
    python benchmarks/real_time.py

Everything runs on one core with one thread. The contestants take turns. The medians over the turns are
printed by the wall clock and by processor time; if these differ, other work used the core too.
With one (G), two (A, B) and five (A, B, G, I, J) clearance joints at 60 rpm:

- the clearance model and full coordinates, with their defaults;
- Exudyn with ideal joints, and with stiff springs in their place (`ExudynLeg`);
- SciPy's solve_ivp on the compiled right-hand side of the full coordinates (`ScipyLeg`).

The benchmark first compares mean forces. Exudyn's step and SciPy's tolerance are as loose as these forces
allow: within 2 % of full coordinates, or within three standard errors where the scatter over the cycles is
more. Exudyn halves its step where its iterations do not converge, so its accuracy depends on the tolerance of
its discontinuous iterations more than on the step that it is given.
About six minutes. Exudyn prints a line or two of its own.
"""

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable, Sequence
from importlib.metadata import version
from statistics import median

# numpy reads the number of threads once, when it is imported
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = os.environ["MKL_NUM_THREADS"] = "1"

# isort: split
import attrs
import numba
import numpy as np
from scipy.integrate import solve_ivp

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun
from leg_wear_monitor.dynamics.full_run import TOLERANCE_RATE, FullRun, FullScratch, accelerate, full_scratch
from leg_wear_monitor.dynamics.run import (
    DRIVE_RATES,
    FORCE,
    JOINT_RATES,
    SPEED,
    RunStatistics,
    Setup,
    new_run_statistics,
)
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import ideal_motion

sys.exudynFast = True  # type: ignore[attr-defined]
import exudyn  # noqa: E402
from exudyn import itemInterface as item  # noqa: E402, N813

LEG = load_mechanism("bionic_leg")
FIVE = ("A", "B", "G", "I", "J")
SETS = (("G",), ("A", "B"), FIVE)
METHODS = ("LSODA", "Radau", "DOP853", "RK45")
FLYWHEEL = 1.0e6  # kg m^2

ALLOWED = 0.02
TOLERANCES = (1.0e-5, 1.0e-6, 1.0e-7)
FEW = 3  # cycles for a method that is far slower than the rest


class Watch:
    """Seconds since it was made, by the wall clock and by the processor's time: less on a shared core."""

    def __init__(self) -> None:
        self._wall, self._processor = time.perf_counter(), time.process_time()

    def read(self) -> tuple[float, float]:
        """Seconds by the wall clock and by the processor's time."""
        return time.perf_counter() - self._wall, time.process_time() - self._processor

    @property
    def processor(self) -> float:
        """Seconds by the processor's time."""
        return self.read()[1]


@attrs.frozen
class Scheme:
    """How Exudyn shall integrate: its step [s], and the stiffness [N/m] of springs for ideal joints or 0."""

    step: float
    penalty: float = 0.0

    @property
    def name(self) -> str:
        return f"springs {self.penalty:.0e} N/m, explicit" if self.penalty else "ideal joints, implicit"

    def settings(self, seconds: float, sampling: float) -> "exudyn.SimulationSettings":
        """Exudyn's settings, the best that were found for this leg with five clearance joints."""
        settings = exudyn.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = sampling
        integration = settings.timeIntegration
        integration.numberOfSteps, integration.endTime = round(seconds / self.step), seconds
        integration.verboseMode = 0
        if self.penalty:
            integration.automaticStepSize = False
            integration.explicitIntegration.eliminateConstraints = False
            integration.explicitIntegration.useLieGroupIntegration = False
            integration.explicitIntegration.computeMassMatrixInversePerBody = True
            integration.discontinuous.iterationTolerance = 1.0e5
            integration.discontinuous.maxIterations = 3
            return settings
        # the tolerance is of |gap K|, in Exudyn's mixed units: contact and its end are met to 0.4 um
        integration.discontinuous.iterationTolerance = 3.0e4
        integration.newton.residualMode = 1  # convergence by increments of the coordinates
        integration.newton.modifiedNewtonContractivity = 0.25
        integration.generalizedAlpha.spectralRadius = 0.6
        integration.adaptiveStepRecoverySteps = 3
        integration.adaptiveStepIncrease = 1.5
        return settings


IMPLICIT = tuple(Scheme(1.0e-6 * us) for us in (1280.0, 640.0, 320.0, 160.0, 80.0, 20.0))
EXPLICIT = (
    Scheme(30.0e-6, 1.0e7),
    Scheme(20.0e-6, 2.0e8),
    Scheme(14.0e-6, 5.0e8),
    Scheme(10.0e-6, 1.0e9),
    Scheme(5.0e-6, 4.0e9),
)


class ExudynLeg:
    """The leg in Exudyn (Gerstmayr, https://github.com/jgerstmayr/EXUDYN), set up from the package's arrays.

    Rigid bodies in the plane, gravity, the crank turning evenly. A clearance joint is
    `ObjectContactSphereSphere` with a hollow sphere, which in the plane is a pin in a bushing: Hertz exponent
    1.5, the package's stiffness and hysteresis factor (Exudyn's Hunt-Crossley model with the restitution that
    gives this factor), friction with the ramp's upper end. Two ways to keep the other joints together:

    - ideal (`ObjectJointRevolute2D`), generalised-alpha: implicit, with Exudyn's discontinuous iterations;
    - springs of a high stiffness, velocity Verlet: explicit. Springs softer than some 1e9 N/m change the
      impacts and with them the forces.

    The crank's inertia is set to 1e6 kg m^2 so that it turns evenly by itself: cheaper than a constraint, and
    without effect on anything but the drive torque. The compiled module without range checks is used.

    Parameters
    ----------
    setup : Setup
    penalty : float
        Stiffness of springs in place of ideal joints [N/m]; 0 for ideal joints.
    watched : bool
        True if the contact forces are recorded.
    """

    def __init__(self, setup: Setup, penalty: float = 0.0, watched: bool = False) -> None:
        self._container = exudyn.SystemContainer()
        self._system = self._container.AddSystem()
        self._setup, self._penalty = setup, penalty
        self._bodies = [self._system.AddObject(item.ObjectGround())]
        self._add_bodies()
        objects = [self._add_joint(joint) for joint in range(len(setup.linkage.arrays.joint_kind))]
        clearance_joints = setup.contacts.joint if watched else []
        self._sensors = [self._watch(objects[joint]) for joint in clearance_joints]
        self._system.Assemble()

    def solve(self, scheme: Scheme, seconds: float) -> tuple[float, float]:
        """Move from the start for a duration; returns the elapsed wall-clock time."""
        sampling = (2.0 * scheme.step if self._penalty else 1.0e-9) if self._sensors else 1.0e9
        settings = scheme.settings(seconds, sampling)
        kinds = exudyn.DynamicSolverType
        kind = kinds.VelocityVerlet if self._penalty else kinds.GeneralizedAlpha
        watch = Watch()
        self._system.SolveDynamic(settings, solverType=kind, showHints=False)
        return watch.read()

    def mean_forces(self, skipped: int, cycles: int) -> Floats:
        """Mean contact forces (cycles, k) [N] of each second after the first ones."""
        means = []
        for sensor in self._sensors:
            t, fx, fy = self._system.GetSensorStoredData(sensor)[:, :3].T
            force = np.hypot(fx, fy)
            impulse = np.append(0.0, np.cumsum(0.5 * np.diff(t) * (force[1:] + force[:-1])))
            means.append(np.diff(np.interp(skipped + np.arange(cycles + 1.0), t, impulse)))
        return np.array(means).T

    def _add_bodies(self) -> None:
        arrays, system = self._setup.linkage.arrays, self._system
        start = ideal_motion(self._setup.linkage, [0.0], self._setup.speed)
        for i in range(1, len(arrays.mass)):
            node = system.AddNode(
                item.NodeRigidBody2D(
                    referenceCoordinates=start.q[0, i].tolist(), initialVelocities=start.v[0, i].tolist()
                )
            )
            mass, _, inertia = arrays.mass[i].tolist()
            inertia = FLYWHEEL if i == arrays.drive_body else inertia
            body = item.ObjectRigidBody2D(nodeNumber=node, physicsMass=mass, physicsInertia=inertia)
            self._bodies.append(system.AddObject(body))
            marker = system.AddMarker(item.MarkerBodyMass(bodyNumber=self._bodies[i]))
            gravity = [*arrays.gravity.tolist(), 0.0]
            system.AddLoad(item.LoadMassProportional(markerNumber=marker, loadVector=gravity))

    def _watch(self, contact: int) -> int:
        """Record the force of a contact; returns the sensor."""
        force = exudyn.OutputVariableType.Force
        sensor = item.SensorObject(objectNumber=contact, storeInternal=True, outputVariableType=force)
        return int(self._system.AddSensor(sensor))

    def _add_joint(self, joint: int) -> int:
        """Add a joint, loose or not; returns its object."""
        arrays, system = self._setup.linkage.arrays, self._system
        clearance_joints = self._setup.contacts.joint.tolist()
        kind = item.MarkerBodyRigid if joint in clearance_joints else item.MarkerBodyPosition
        bushing, journal = (
            system.AddMarker(kind(bodyNumber=self._bodies[body], localPosition=[*point.tolist(), 0.0]))
            for body, point in zip(arrays.joint_body[joint], arrays.joint_point[joint], strict=True)
        )
        if joint in clearance_joints:
            return int(system.AddObject(self._contact(clearance_joints.index(joint), bushing, journal)))
        markers, k = [bushing, journal], self._penalty
        if not k:
            return int(system.AddObject(item.ObjectJointRevolute2D(markerNumbers=markers)))
        damping = 0.04 * float(np.sqrt(k))  # N s/m: 2 % of critical damping for 1 kg
        spring = {"stiffness": [k, k, 0.0], "damping": [damping, damping, 0.0]}
        return int(
            system.AddObject(item.ObjectConnectorCartesianSpringDamper(markerNumbers=markers, **spring))
        )

    def _contact(self, k: int, bushing: int, journal: int) -> item.ObjectContactSphereSphere:
        """Clearance joint k, a sphere (the journal) in a hollow sphere (the bushing)."""
        contacts = self._setup.contacts
        outer, clearance = float(contacts.bushing_radius[k]), float(contacts.clearance[k])
        inner = outer - clearance
        hertz = float(contacts.modulus[k]) * np.sqrt(inner * outer / clearance)
        node = item.NodeGenericData(initialCoordinates=[clearance, 0.0, 0.0, 0.0], numberOfDataCoordinates=4)
        return item.ObjectContactSphereSphere(
            markerNumbers=[journal, bushing],
            nodeNumber=self._system.AddNode(node),
            spheresRadii=[inner, outer],
            isHollowSphere1=True,
            contactStiffness=float(contacts.stiffness[k] or hertz),
            contactStiffnessExponent=1.5,
            impactModel=1,
            restitutionCoefficient=1.0 - float(contacts.hysteresis[k]) / 1.5,
            minimumImpactVelocity=float(contacts.speed_floor[k]),
            dynamicFriction=float(contacts.friction[k, 0]),
            frictionProportionalZone=float(contacts.friction[k, 2]),
        )


RightHandSide = Callable[[float, Floats], Floats]


def impact_speeds(setup: Setup, statistics: RunStatistics) -> Floats:
    """Root mean square (k,) of the approach speeds of the impacts in each clearance joint [m/s]."""
    counts = np.minimum(statistics.impacts, statistics.impact.shape[1])
    joints = setup.contacts.joint
    speeds = (statistics.impact[joint, : counts[joint], SPEED] for joint in joints)
    return np.array([np.sqrt(np.mean(of_joint**2)) for of_joint in speeds])


def right_hand_side(setup: Setup, run: FullRun, approach: Floats) -> RightHandSide:
    """Compile dy/dt for y (6 b + k,): coordinates, velocities, integrals of the contact forces."""
    model, surfaces, polynomial, joints = run.model, setup.surfaces, run.polynomial, setup.contacts.joint
    n, half, k = len(model.arrays.mass), 3 * len(model.arrays.mass) - 3, len(setup.clearance_joints)
    rates = (len(model.arrays.joint_kind), JOINT_RATES)
    cs, force, phi, jac, gamma, schur, lam, drive, contact = (part.shape for part in full_scratch(model))

    @numba.njit(error_model="numpy")
    def derivative(t, y):
        scratch = FullScratch(
            np.empty(cs), np.empty(force), np.empty(phi), np.empty(jac), np.empty(gamma), np.empty(schur),
            np.empty(lam), np.empty(drive), np.empty(contact),
        )  # fmt: skip
        q, v, a = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
        rate, out = np.zeros(rates), np.empty(y.shape[0])
        for i in range(half):
            q[1 + i // 3, i % 3], v[1 + i // 3, i % 3] = y[i], y[half + i]
        accelerate(model, surfaces, approach, polynomial, t, q, v, scratch, a, rate, np.zeros(DRIVE_RATES))
        for i in range(half):
            out[i], out[half + i] = v[1 + i // 3, i % 3], a[1 + i // 3, i % 3]
        for i in range(k):
            out[2 * half + i] = rate[joints[i], FORCE]
        return out

    return derivative


class ScipyLeg:
    """A leg where a run in full coordinates has brought it, for `scipy.integrate.solve_ivp`.

    An ordinary differential equation in the 42 coordinates and velocities (closures by Baumgarte, the crank's
    motion prescribed). Contact is on where the penetration is positive, without events. The approach speed of
    the damping law, which the package takes from each impact, is one fixed value per joint here: the root
    mean square over the impacts of the package's own run, which gives the same mean forces. So an integrator
    may step as it likes, which favours SciPy.

    Parameters
    ----------
    setup : Setup
    run : FullRun
        Run of this setup.
    approach : (k,) array, m/s
    """

    def __init__(self, setup: Setup, run: FullRun, approach: Floats) -> None:
        self._derivative = right_hand_side(setup, run, approach)
        self._clearance_joints = len(setup.clearance_joints)
        self._start = np.concatenate([run.q[1:].ravel(), run.v[1:].ravel(), np.zeros(self._clearance_joints)])
        self._y, self._since, self.time = self._start.copy(), run.time, run.time
        self._derivative(self.time, self._y)  # compiles

    def back(self) -> None:
        """Go back to where it began."""
        self._y, self.time = self._start.copy(), self._since

    def evaluation_time(self, evaluations: int = 20_000) -> float:
        """Seconds of one right-hand side, called from Python."""
        watch = Watch()
        for _ in range(evaluations):
            self._derivative(self.time, self._y)
        return watch.processor / evaluations

    def advance(
        self, method: str, tolerance_m: float, seconds: float
    ) -> tuple[tuple[float, float], Floats, int]:
        """Go on for so long [s] with a local error as the package defines it.

        Returns the elapsed wall-clock time, the mean forces (k,) [N], and the evaluations.
        """
        half = (len(self._y) - self._clearance_joints) // 2
        at_most = np.concatenate([np.full(half, tolerance_m), np.full(half, tolerance_m * TOLERANCE_RATE)])
        at_most = np.append(
            at_most, np.full(self._clearance_joints, 1.0e9)
        )  # the integrals do not choose the step
        self._y[2 * half :] = 0.0
        end, watch = self.time + seconds, Watch()
        with np.errstate(all="ignore"):  # a trial step may go too far, and is then taken back
            found = solve_ivp(
                self._derivative, (self.time, end), self._y,
                method=method, rtol=1.0e-12, atol=at_most, max_step=1.0e-3, t_eval=[end],
            )  # fmt: skip
        spent = watch.read()
        if not found.success:
            raise RuntimeError(f"{method} at {tolerance_m:g} m: {found.message}")
        self._y, self.time = found.y[:, -1], end
        return spent, self._y[2 * half :] / seconds, int(found.nfev)


class Forces:
    """Mean contact forces (k,) and their standard errors [N], from the means of cycles (n, k)."""

    def __init__(self, of_cycles: np.ndarray) -> None:
        self.mean = of_cycles.mean(axis=0)
        self.error = of_cycles.std(axis=0, ddof=1) / np.sqrt(len(of_cycles))

    def off(self, other: "Forces") -> np.ndarray:
        return np.asarray(self.mean / other.mean - 1.0)

    def agree(self, other: "Forces") -> bool:
        chance = 3.0 * np.hypot(self.error, other.error) / other.mean
        return bool((np.abs(self.off(other)) <= np.maximum(ALLOWED, chance)).all())


def own_forces(run: ClearanceRun | FullRun, setup: Setup, cycles: int) -> tuple[Forces, RunStatistics]:
    """Forces of the package's own models in the cycles after the first; and the tally over them all."""
    joints = len(setup.linkage.mechanism.joints)
    run.advance(1.0, new_run_statistics(joints))
    statistics, sums = new_run_statistics(joints), [np.zeros(len(setup.clearance_joints))]
    for cycle in range(cycles):
        run.advance(2.0 + cycle, statistics)
        sums.append(statistics.integral[setup.contacts.joint, FORCE].copy())
    return Forces(np.diff(sums, axis=0)), statistics


def exudyn_forces(setup: Setup, scheme: Scheme, cycles: int) -> tuple[Forces, float]:
    """Forces after the first cycle, and the real-time factor."""
    leg = ExudynLeg(setup, scheme.penalty, watched=True)
    _, spent = leg.solve(scheme, 1.0 + cycles)
    return Forces(leg.mean_forces(1, cycles)), (1.0 + cycles) / spent


def scipy_forces(leg: ScipyLeg, method: str, tolerance: float, cycles: int) -> tuple[Forces, float, float]:
    """Forces, the real-time factor, and evaluations in a cycle."""
    leg.back()
    turns = [leg.advance(method, tolerance, 1.0) for _ in range(cycles)]
    evaluations = sum(turn[2] for turn in turns) / cycles
    forces = Forces(np.array([turn[1] for turn in turns]))
    return forces, cycles / sum(turn[0][1] for turn in turns), evaluations


def print_heading(what: str, clearance_joints: Sequence[str]) -> None:
    names = "".join(f"{joint + ' [N]':>18}" for joint in clearance_joints)
    print(f"\n{what}\n  {'':42}{'factor':>8} {'cycles':>6} {names}   fits")


def print_forces(what: str, factor: float, cycles: int, forces: Forces, reference: Forces) -> None:
    """A row: real-time factor, mean forces and how far they are off the reference."""
    pairs = zip(forces.mean, forces.off(reference), strict=True)
    cells = "".join(f"{mean:9.2f} {100.0 * off:+6.2f} %" for mean, off in pairs)
    fits = "yes" if forces.agree(reference) else "no"
    print(f"  {what:42}{factor:8.2f} {cycles:6d} {cells}   {fits}", flush=True)


def sweep_exudyn(setup: Setup, reference: Forces, cycles: int) -> list[Scheme]:
    """Forces over Exudyn's step; the fastest scheme that keeps them, with ideal joints and with springs."""
    print_heading("Exudyn (recording the forces, which costs it some of its speed)", setup.clearance_joints)
    best = []
    for schemes in (IMPLICIT, EXPLICIT):
        fit = []
        for scheme in schemes:
            forces, factor = exudyn_forces(setup, scheme, cycles)
            print_forces(f"{scheme.name}, {1e6 * scheme.step:.0f} us", factor, cycles, forces, reference)
            if forces.agree(reference):
                fit.append((factor, scheme.step, scheme.penalty))
        best.append(Scheme(*max(fit)[1:]))
    return best


def sweep_scipy(leg: ScipyLeg, setup: Setup, reference: Forces, cycles: int) -> tuple[str, float]:
    """Forces over SciPy's methods and tolerances; the fastest pair that keeps them."""
    print_heading(f"SciPy ({1e6 * leg.evaluation_time():.1f} us an evaluation)", setup.clearance_joints)
    fit = []
    for method in METHODS:
        count = FEW if method == "Radau" else cycles
        for tolerance in TOLERANCES:
            forces, factor, evaluations = scipy_forces(leg, method, tolerance, count)
            what = f"{method:6} {tolerance:.0e} m, {evaluations:,.0f} evaluations"
            print_forces(what, factor, count, forces, reference)
            if forces.agree(reference):
                fit.append((factor, method, tolerance))
    return max(fit)[1:]


Factors = tuple[float, float]
Contestant = Callable[[], Factors]


def compare_own(setup: Setup, cycles: int) -> tuple[Forces, FullRun, RunStatistics]:
    """Forces of the package's two models; the reference, and the run and the tally it comes from."""
    full, clearance, watch = FullRun(setup), ClearanceRun(setup), Watch()
    reference, statistics = own_forces(full, setup, 3 * cycles)
    factor = 3 * cycles / watch.processor
    print_heading(
        "Mean contact forces of five clearance joints, off full coordinates by", setup.clearance_joints
    )
    print_forces("full coordinates", factor, 3 * cycles, reference, reference)
    print(f"  {'  their standard error':57} " + "".join(f"{e:9.2f}{'':9}" for e in reference.error))
    watch = Watch()
    forces, _ = own_forces(clearance, setup, 10 * cycles)
    print_forces("clearance model", 10 * cycles / watch.processor, 10 * cycles, forces, reference)
    return reference, full, statistics


def check_others(
    clearance_joints: Sequence[str], schemes: Sequence[Scheme], method: str, tolerance: float, cycles: int
) -> None:
    """Forces of the other programs with fewer clearance joints, with their best settings for five joints."""
    setup = prepare(LEG, clearances=clearance_joints)
    full = FullRun(setup)
    reference, statistics = own_forces(full, setup, 3 * cycles)
    print_heading(f"The same settings with clearance in {','.join(clearance_joints)}", clearance_joints)
    for scheme in schemes:
        forces, factor = exudyn_forces(setup, scheme, cycles)
        print_forces(f"Exudyn, {scheme.name}", factor, cycles, forces, reference)
    leg = ScipyLeg(setup, full, impact_speeds(setup, statistics))
    forces, factor, _ = scipy_forces(leg, method, tolerance, cycles)
    print_forces(f"SciPy, {method}", factor, cycles, forces, reference)


def own_contestant(run: ClearanceRun | FullRun, cycles: float, statistics: RunStatistics) -> Contestant:
    """A model of the package, after its first cycle."""

    def turn() -> Factors:
        watch = Watch()
        run.advance(run.time + cycles, statistics)
        return factors(cycles, watch.read())

    run.advance(1.0, statistics)
    return turn


def factors(seconds: float, spent: tuple[float, float]) -> Factors:
    """Real-time factors of so much motion by the wall clock and by the processor's time."""
    return seconds / spent[0], seconds / spent[1]


def contestants(
    setup: Setup, schemes: Sequence[Scheme], method: str, tolerance: float
) -> dict[str, Contestant]:
    """Contestants that take turns: each call moves the leg on and returns the real-time factors."""

    def exudyn(scheme: Scheme) -> Contestant:
        return lambda: factors(2.0, ExudynLeg(setup, scheme.penalty).solve(scheme, 2.0))

    statistics, full = new_run_statistics(len(LEG.joints)), FullRun(setup)
    entries = {
        "clearance model": own_contestant(ClearanceRun(setup), 10.0, new_run_statistics(len(LEG.joints))),
        "full coordinates": own_contestant(full, 3.0, statistics),
    }
    entries["full coordinates"]()
    entries |= {f"Exudyn, {scheme.name}": exudyn(scheme) for scheme in schemes}
    leg = ScipyLeg(setup, full, impact_speeds(setup, statistics))
    return entries | {f"SciPy, {method}": lambda: factors(1.0, leg.advance(method, tolerance, 1.0)[0])}


def race(schemes: Sequence[Scheme], method: str, tolerance: float, repeats: int) -> None:
    """Let them take turns with every set of clearance joints, and print the medians."""
    medians: list[dict[str, Factors]] = []
    for clearance_joints in SETS:
        entries = contestants(prepare(LEG, clearances=clearance_joints), schemes, method, tolerance)
        turns: dict[str, list[Factors]] = {name: [] for name in entries}
        for _ in range(repeats):
            for name, turn in entries.items():
                turns[name].append(turn())
        medians.append(
            {name: (median(wall for wall, _ in of), median(p for _, p in of)) for name, of in turns.items()}
        )
    for by, clock in enumerate(("wall clock", "processor's time")):
        print(f"\nReal-time factor by the {clock}, medians of {repeats} turns (over the clearance model's)")
        print(
            f"  {'clearance joints':42}"
            + "".join(f"{','.join(clearance_joints):>20}" for clearance_joints in SETS)
        )
        for name in medians[0]:
            cells = (
                f"{m[name][by]:10.2f} (1/{m['clearance model'][by] / m[name][by]:5.1f})" for m in medians
            )
            print(f"  {name:42}" + "".join(f"{cell:>20}" for cell in cells))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=7, help="turns of each contestant")
    parser.add_argument("--cycles", type=int, default=20, help="cycles for the mean forces of the others")
    options = parser.parse_args()
    names = ("numpy", "numba", "scipy", "exudyn")
    print(f"Python {platform.python_version()}, " + ", ".join(f"{name} {version(name)}" for name in names))
    cores = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, cores[-1:])
    print(f"{platform.system()} {platform.machine()}, one of {len(cores)} cores")
    setup = prepare(LEG, clearances=FIVE)
    reference, full, statistics = compare_own(setup, options.cycles)
    schemes = sweep_exudyn(setup, reference, options.cycles)
    leg = ScipyLeg(setup, full, impact_speeds(setup, statistics))
    method, tolerance = sweep_scipy(leg, setup, reference, options.cycles)
    for clearance_joints in SETS[:2]:
        check_others(clearance_joints, schemes, method, tolerance, options.cycles)
    race(schemes, method, tolerance, options.repeats)


if __name__ == "__main__":
    main()

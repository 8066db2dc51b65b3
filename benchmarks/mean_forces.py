"""Mean contact forces of chaotic motion with their scatter: what contestants must agree on before they race.

Exudyn's step and SciPy's tolerance are as loose as these forces allow: within 2 % of full coordinates, or
within three standard errors where the scatter over the cycles is more. Real-time factors here are by the
processor's time.
"""

from collections.abc import Sequence

import numpy as np
from exudyn_leg import ExudynLeg, Scheme
from scipy_leg import METHODS, ScipyLeg

from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import FORCE, RunStatistics, Setup, new_run_statistics

ALLOWED = 0.02
IMPLICIT = tuple(Scheme(1.0e-6 * us) for us in (1280.0, 640.0, 320.0, 160.0, 80.0, 20.0))
EXPLICIT = (
    Scheme(30.0e-6, 1.0e7),
    Scheme(20.0e-6, 2.0e8),
    Scheme(14.0e-6, 5.0e8),
    Scheme(10.0e-6, 1.0e9),
    Scheme(5.0e-6, 4.0e9),
)
TOLERANCES = (1.0e-5, 1.0e-6, 1.0e-7)
FEW = 3  # cycles where a method is far slower than the others


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

"""The leg's full coordinates given to `scipy.integrate.solve_ivp`: the package's compiled right-hand side.

An ordinary differential equation in the 42 coordinates and velocities (closures by Baumgarte, the crank's
motion prescribed). Contact is on where the penetration is positive, without events. The approach speed of
the damping law, which the package takes from each impact, is one fixed value per joint here: the root mean
square over the impacts of the package's own run, which gives the same mean forces. So an integrator may step
as it likes, which favours SciPy.
"""

from collections.abc import Callable

import numba
import numpy as np
from scipy.integrate import solve_ivp
from watch import Watch

from leg_wear_monitor.dynamics.full_model import FullScratch, accelerate, full_scratch
from leg_wear_monitor.dynamics.full_run import TOLERANCE_RATE, FullRun
from leg_wear_monitor.dynamics.run import DRIVE_RATES, FORCE, JOINT_RATES, SPEED, RunStatistics, Setup
from leg_wear_monitor.mechanism.arrays import Floats

METHODS = ("LSODA", "Radau", "DOP853", "RK45")

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
    """A leg where a run in full coordinates has brought it.

    Parameters
    ----------
    setup : Setup
    run : FullRun
        Of this setup.
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

        Returns what that took, as a watch reads it, the mean forces (k,) [N], and the evaluations.
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

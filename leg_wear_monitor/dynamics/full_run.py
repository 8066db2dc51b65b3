"""Time integration in full coordinates: adaptive steps and contact events (physics.md section 2)."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import entry, kernel
from leg_wear_monitor.compiled.vectors import copy_array
from leg_wear_monitor.dynamics.full_model import (
    NO_TOE,
    FullModel,
    FullScratch,
    Toe,
    accelerate,
    compare_toe,
    full_model,
    full_scratch,
    ideal_toe,
    total_energy,
)
from leg_wear_monitor.dynamics.joint import (
    EX,
    EY,
    NEVER,
    SAMPLE,
    first_contact_event,
    pushed_through,
    update_contacts,
    wear_joint,
)
from leg_wear_monitor.dynamics.run import (
    ARCHARD,
    DONE,
    DRIVE_RATES,
    FORCE,
    JOINT_RATES,
    NODES,
    PUSHED_THROUGH,
    SINGULAR,
    STAGES,
    STEP_TOO_SMALL,
    TORQUE,
    WEIGHTS,
    RunStatistics,
    Sample,
    Setup,
    add_step,
    error_norm,
    new_run_statistics,
    next_step,
    stage_state,
    steady_drive,
    stop,
)
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import assemble, ideal_motion, rotated
from leg_wear_monitor.mechanism.spec import SpeedDrive, TorqueDrive
from leg_wear_monitor.wear import BUSHING

# Time integration in full coordinates: adaptive steps and contact events (physics.md section 2).
#
# The local error of every step is below a tolerance in every coordinate and velocity (Dormand-Prince 5(4)).
# If a contact would begin within a step, the step is shortened to end at the contact's start, to 1e-11 m.


LONGEST_STEP = 1.0e-3  # s: its product with Baumgarte's alpha is well inside the region of stability
_SHORTEST_STEP = 1.0e-14  # s


class FullState(NamedTuple):
    """Complete state of a run, the surfaces aside.

    ``y`` (6 n,): coordinates, then velocities, of n bodies [m, m, rad; per s]; ``clock`` (2,) [s]: time, and
    the next trial step; ``approach`` (k,) [m/s]: approach speed of each clearance joint in contact, 0 for
    open joints; ``recent`` (k, 4): its last two samples of time [s] and normal force [N].
    """

    y: Floats
    clock: Floats
    approach: Floats
    recent: Floats


class FullWork(NamedTuple):
    """Work arrays of a step, for n bodies, j joints and k clearance joints.

    ``slope`` (7, 6 n): slopes of the stages; ``trial`` (6 n,): trial state; ``rates`` (7, j, JOINT_RATES),
    ``drive_rates`` (7, DRIVE_RATES): rates of the statistics' integrals; ``start`` (SAMPLE, k): samples at
    its start; ``scale`` (6 n,): error tolerances; ``weight`` (N,): of the wear on an arc; ``scratch``.
    """

    slope: Floats
    trial: Floats
    rates: Floats
    drive_rates: Floats
    start: Floats
    scale: Floats
    weight: Floats
    scratch: FullScratch


def full_state(q: Floats, v: Floats, clearance_joints: int, t: float = 0.0) -> FullState:
    """Initial state with open joints at time t [s]: coordinates q (n, 3) and velocities v (n, 3)."""
    y = np.concatenate([q.ravel(), v.ravel()])
    return FullState(y, np.array([t, 1.0e-6]), np.zeros(clearance_joints), np.zeros((clearance_joints, 4)))


def full_work(model: FullModel, tolerance_m: float, tolerance_mps: float, sectors: int) -> FullWork:
    """Work arrays; the tolerances apply to a step's local error, of coordinates and of velocities."""
    n, k = len(model.arrays.mass), len(model.contacts.joint)
    joints = len(model.arrays.joint_kind)
    return FullWork(
        slope=np.zeros((STAGES, 6 * n)),
        trial=np.zeros(6 * n),
        rates=np.zeros((STAGES, joints, JOINT_RATES)),
        drive_rates=np.zeros((STAGES, DRIVE_RATES)),
        start=np.zeros((SAMPLE, k)),
        scale=np.concatenate([np.full(3 * n, tolerance_m), np.full(3 * n, tolerance_mps)]),
        weight=np.zeros(sectors),
        scratch=full_scratch(model),
    )


@kernel
def _slope(model, surfaces, approach, polynomial, t, y, s, work):
    """Slope of stage s for state y (6 n,) at t [s]: velocities, then accelerations; False if singular."""
    half = y.shape[0] // 2
    for i in range(half):
        work.slope[s, i] = y[half + i]
    q, v = y[:half].reshape(-1, 3), y[half:].reshape(-1, 3)
    a = work.slope[s, half:].reshape(-1, 3)
    return accelerate(
        model, surfaces, approach, polynomial, t, q, v, work.scratch, a, work.rates[s], work.drive_rates[s]
    )


@kernel
def _try_step(model, surfaces, state, polynomial, h, work):
    """Trial step of length h [s]: its end in ``work.trial``; returns the local error over the tolerance."""
    t = state.clock[0]
    for s in range(1, STAGES):
        stage_state(s, h, state.y, work.slope, work.trial)
        if not _slope(model, surfaces, state.approach, polynomial, t + NODES[s] * h, work.trial, s, work):
            return math.inf
    return error_norm(h, work.slope, work.scale)


@kernel
def slope_here(model, surfaces, state, polynomial, work):
    """Evaluate the first stage of the next step at the present state; False if the closures are singular."""
    good = _slope(model, surfaces, state.approach, polynomial, state.clock[0], state.y, 0, work)
    copy_array(work.scratch.contact, work.start)
    return good


@kernel
def _accept(model, surfaces, state, h, toe, statistics, work):
    """Accept the trial step of length h [s]: statistics, wear, contact events.

    Returns whether a contact began or ended.
    """
    arrays, contacts, scratch = model.arrays, model.contacts, work.scratch
    half = state.y.shape[0] // 2
    q, v = work.trial[:half].reshape(-1, 3), work.trial[half:].reshape(-1, 3)
    last = STAGES - 1
    statistics.steps[1] += 1
    add_step(statistics, h, WEIGHTS, work.rates, work.drive_rates)
    a = work.slope[last, half:].reshape(-1, 3)
    torque = work.drive_rates[last, TORQUE]
    compare_toe(toe, q[arrays.drive_body, 2], scratch.cs, q, v, a, torque, statistics.response)
    for k in range(contacts.joint.shape[0]):
        if state.approach[k] > 0.0:
            joint = contacts.joint[k]
            integral = 0.0
            for s in range(STAGES):
                integral += h * WEIGHTS[s] * work.rates[s, joint, ARCHARD]
            b, j = arrays.joint_body[joint, 0], arrays.joint_body[joint, 1]
            ex, ey = scratch.contact[EX, k], scratch.contact[EY, k]
            here = (ex, ey, q[b, 2], q[j, 2])
            statistics.worn_energy[0] += wear_joint(
                contacts, surfaces, k, ex, ey, q[b, 2], q[j, 2], here, integral, work.weight
            )
    changed, _ = update_contacts(
        contacts.joint, contacts.speed_floor, state.clock[0], h, work.start, scratch.contact,
        state.approach, state.recent, statistics.peak, statistics.impact, statistics.impacts,
    )  # fmt: skip
    copy_array(work.trial, state.y)
    state.clock[0] += h
    copy_array(work.slope[last], work.slope[0])
    copy_array(work.rates[last], work.rates[0])
    copy_array(work.drive_rates[last], work.drive_rates[0])
    copy_array(scratch.contact, work.start)
    return changed


@entry
def advance_full(model, surfaces, state, polynomial, t_end, toe, statistics, work):
    """Advance the state to t_end [s] and add to the run statistics.

    Returns
    -------
    status, k
        DONE, or the reason for stopping and the clearance joint concerned (-1 if none). The state is then the
        last accepted one.
    """
    scratch = work.scratch
    if not slope_here(model, surfaces, state, polynomial, work):
        return SINGULAR, -1
    cut = NEVER  # fraction of the last trial step after which a contact began
    while state.clock[0] < t_end:
        h = state.clock[1]
        left = t_end - state.clock[0]
        if cut < 1.0:
            h *= cut
        ends = h >= left * (1.0 - 1.0e-12)
        if ends:
            h = left
        statistics.steps[0] += 1
        error = _try_step(model, surfaces, state, polynomial, h, work)
        if not error <= 1.0:
            state.clock[1] = next_step(h, error, 1.0)
            cut = NEVER
            if state.clock[1] < _SHORTEST_STEP:
                return STEP_TOO_SMALL, pushed_through(model.contacts.bushing_radius, scratch.contact)
            continue
        fraction = first_contact_event(state.approach, h, work.start, scratch.contact)
        if fraction < 1.0 and fraction * h > _SHORTEST_STEP:
            cut = fraction * h / state.clock[1]
            continue
        pushed = pushed_through(model.contacts.bushing_radius, scratch.contact)
        if pushed >= 0:
            return PUSHED_THROUGH, pushed
        if not ends and cut == NEVER:
            state.clock[1] = min(LONGEST_STEP, next_step(h, error, 5.0))
        cut = NEVER
        changed = _accept(model, surfaces, state, h, toe, statistics, work)
        if changed and not slope_here(model, surfaces, state, polynomial, work):
            return SINGULAR, -1
        if ends:
            state.clock[0] = t_end
    return DONE, -1


# The full-coordinate formulation as a `Run`.


# local error of a step in every coordinate [m, rad]; the energy residual is 1e-3 of the losses
TOLERANCE_M = 1.0e-10
TOLERANCE_RATE = 1.0e4  # 1/s: ratio of the velocities' tolerance to it, the reciprocal duration of a contact


class FullRun:
    """A leg in full coordinates that starts from its ideal motion, journals centred (physics.md section 2).

    Parameters
    ----------
    setup : Setup
    tolerance_m : float
        Local error allowed in a step [m or rad]; for velocities, `TOLERANCE_RATE` times it per second.

    Attributes
    ----------
    state : FullState
        Complete state, the surfaces aside.
    """

    def __init__(self, setup: Setup, tolerance_m: float = TOLERANCE_M) -> None:
        linkage = setup.linkage
        driven = isinstance(linkage.mechanism.drive, SpeedDrive)
        self._setup = setup
        self.model = full_model(linkage.arrays, setup.contacts, driven)
        self.state = _start(setup)
        self.toe: Toe = ideal_toe(linkage, setup.speed) if driven else NO_TOE
        self.polynomial = steady_drive(0.0, setup.speed)
        sectors = setup.surfaces.depth.shape[2]
        self._work = full_work(self.model, tolerance_m, tolerance_m * TOLERANCE_RATE, sectors)
        self.advance(0.0, new_run_statistics(0))  # evaluates the initial state for `sample`

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return float(self.state.clock[0])

    @property
    def q(self) -> Floats:
        """Coordinates (n, 3): centre of mass [m] and angle [rad] of every body, ground first."""
        return self.state.y[: len(self.state.y) // 2].reshape(-1, 3)

    @property
    def v(self) -> Floats:
        """Velocities (n, 3)."""
        return self.state.y[len(self.state.y) // 2 :].reshape(-1, 3)

    @property
    def lam(self) -> Floats:
        """Multipliers (m,) of the ideal joints' rows and the drive's, in the order of ``model.rows``."""
        return self._work.scratch.lam

    @property
    def stored_energy(self) -> float:
        """Kinetic energy plus the potential energy of gravity, springs and contacts [J]."""
        energy = total_energy(self.model, self._setup.surfaces, self.q, self.v, self._work.scratch)
        return float(energy)

    def advance(self, t_end: float, statistics: RunStatistics) -> None:
        """Advance to a time [s] and add to run statistics.

        Raises
        ------
        SimulationError
            If the motion diverges; names the joint, the time and a remedy.
        """
        status, k = advance_full(
            self.model,
            self._setup.surfaces,
            self.state,
            self.polynomial,
            t_end,
            self.toe,
            statistics,
            self._work,
        )
        if status != DONE:
            raise stop(self._setup, status, k, self.time)

    def sample(self) -> Sample:
        """The present state of the leg."""
        work, toe = self._work, np.zeros((3, 2))
        if self.toe.body >= 0:
            x, y, angle = self.q[self.toe.body]
            turning, slope = self.v[self.toe.body], work.slope[0].reshape(2, -1, 3)[1, self.toe.body]
            lever = rotated(self.toe.point, angle)
            across = np.array([-lever[1], lever[0]])
            toe[0] = x + lever[0], y + lever[1]
            toe[1] = turning[:2] + turning[2] * across
            toe[2] = slope[:2] + slope[2] * across - turning[2] ** 2 * lever
        return Sample(
            float(self.q[self.model.arrays.drive_body, 2]),
            toe,
            float(work.drive_rates[0, TORQUE]),
            work.rates[0, :, FORCE].copy(),
            work.start.copy(),
            self.state.approach > 0.0,
            self._setup.surfaces.depth[:, BUSHING].max(axis=1),
        )


def _start(setup: Setup) -> FullState:
    """Initial state: the ideal motion at crank angle 0, or at the assembly's angle for a constant torque."""
    linkage = setup.linkage
    if not isinstance(linkage.mechanism.drive, TorqueDrive):
        motion = ideal_motion(linkage, [0.0], setup.speed)
        return full_state(motion.q[0], motion.v[0], len(setup.clearance_joints))
    angle = linkage.mechanism.assembly.crank_angle
    velocity = ideal_motion(linkage, [angle], setup.speed).v[0]
    return full_state(assemble(linkage), velocity, len(setup.clearance_joints))

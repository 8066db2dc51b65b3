"""Shared parts of both formulations: interface, crank motion, statistics of a run, Runge-Kutta."""

import math
from typing import NamedTuple, Protocol

import attrs
import numpy as np

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import bits_of
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.errors import SimulationError
from leg_wear_monitor.mechanism.arrays import Flags, Floats, Ints
from leg_wear_monitor.mechanism.materials import Bushing
from leg_wear_monitor.mechanism.position import Linkage
from leg_wear_monitor.wear import Surfaces

# The crank's motion as a polynomial in time, for a steady drive, a ripple or a tracked crank.


DEGREE = 5


class CrankMotion(NamedTuple):
    """Angle [rad], speed [rad/s] and acceleration [rad/s^2] of the crank."""

    angle: float
    speed: float
    acceleration: float


def steady_drive(angle: float, speed: float, since: float = 0.0) -> Floats:
    """Polynomial of a crank with constant speed.

    Parameters
    ----------
    angle, speed : float
        Crank angle [rad] and speed [rad/s] at time ``since`` [s].

    Returns
    -------
    (7,) array
        Reference time [s], then six coefficients [rad/s^i] by ascending power.
    """
    return np.array([since, angle, speed, 0.0, 0.0, 0.0, 0.0])


def quintic(since: float, start: CrankMotion, span: float, end: CrankMotion) -> Floats:
    """Drive polynomial (7,) through two states of the crank, ``span`` seconds apart.

    Consecutive polynomials join with continuous acceleration.
    """
    a0, v0, w0 = start.angle, start.speed, start.acceleration
    gap = end.angle - a0 - span * (v0 + 0.5 * span * w0)
    slope = (end.speed - v0 - span * w0) * span
    bend = (end.acceleration - w0) * span * span
    cubic = 10.0 * gap - 4.0 * slope + 0.5 * bend
    quartic = -15.0 * gap + 7.0 * slope - bend
    fifth = 6.0 * gap - 3.0 * slope + 0.5 * bend
    return np.array([since, a0, v0, 0.5 * w0, cubic / span**3, quartic / span**4, fifth / span**5])


@kernel
def drive_at(polynomial, t, out_drive):
    """Angle [rad], speed [rad/s] and acceleration [rad/s^2] (3,) of the crank at time t [s]."""
    tau = t - polynomial[0]
    angle, speed, acceleration = 0.0, 0.0, 0.0
    for i in range(DEGREE, -1, -1):
        acceleration = acceleration * tau + 2.0 * speed
        speed = speed * tau + angle
        angle = angle * tau + polynomial[1 + i]
    out_drive[0], out_drive[1], out_drive[2] = angle, speed, acceleration


# Run statistics: integrals, extremes, distributions and impacts of every joint and of the drive.
#
# Memory does not grow with the length of the run: a distribution is a histogram of time, and impacts after
# the first thousand are only counted.


# integrals of a joint: |F| [N s], F^2 [N^2 s], time in contact [s], friction work [J], loss in the normal
# direction [J], F_N |v_t| [J]
FORCE, FORCE_SQUARED, CONTACT, FRICTION, DISSIPATION, ARCHARD = 0, 1, 2, 3, 4, 5
JOINT_RATES = 6
# integrals of the drive: torque [N m s], torque^2 [N^2 m^2 s], work from outside [J]
TORQUE, TORQUE_SQUARED, POWER = 0, 1, 2
DRIVE_RATES = 3
# impacts: time it begins [s], approach speed [m/s], time it ends [s], peak normal force [N]
BEGIN, SPEED, END, PEAK = 0, 1, 2, 3
IMPACTS = 1000
# index of the drive torque [N m] in the largest deviations from the ideal linkage, after the toe's three
TORQUE_ERROR = 3

# bins of a histogram: 128 per octave, at most 0.8 % wide, from 2^-20 to 2^30
_FIRST_OCTAVE, _OCTAVES, _IN_OCTAVE = -20, 50, 128
_BINS = _OCTAVES * _IN_OCTAVE
# least ratio of two successive steps for a parabola through their ends; steps shrink to 0.2 at a time
_MOST_UNEQUAL = 0.1
# 7 of the 52 binary digits of a number give 128 bins; its exponent is stored plus 1023
_DIGITS_AFTER_BIN, _BITS_OF_FIRST = 52 - 7, (1023 + _FIRST_OCTAVE) * _IN_OCTAVE


class RunStatistics(NamedTuple):
    """Statistics over the evaluated time, for j joints and the drive.

    ``time`` (1,) [s]: evaluated time; ``integral`` (j, 6), ``drive_integral`` (3,): columns and units above;
    ``peak`` (j,) [N]: largest force; ``drive_range`` (2,) [N m]: least and largest torque;
    ``force_time`` (j, bins), ``torque_time`` (2, bins) [s]: time at each magnitude, of negative and positive
    torque; ``impact`` (j, 1000, 4): columns above; ``impacts`` (j,): number of impacts;
    ``response`` (4,) [m, m/s, m/s^2, N m]: largest deviations from the ideal linkage, of the toe and of the
    drive torque; ``worn_energy`` (1,) [J]: elastic contact energy lost with removed material;
    ``steps`` (2,): number of trial steps and of accepted steps.
    """

    time: Floats
    integral: Floats
    drive_integral: Floats
    peak: Floats
    drive_range: Floats
    force_time: Floats
    torque_time: Floats
    impact: Floats
    impacts: Ints
    response: Floats
    worn_energy: Floats
    steps: Ints


def new_run_statistics(joints: int) -> RunStatistics:
    """Empty run statistics."""
    return RunStatistics(
        time=np.zeros(1),
        integral=np.zeros((joints, JOINT_RATES)),
        drive_integral=np.zeros(DRIVE_RATES),
        peak=np.zeros(joints),
        drive_range=np.array([np.inf, -np.inf]),
        force_time=np.zeros((joints, _BINS)),
        torque_time=np.zeros((2, _BINS)),
        impact=np.zeros((joints, IMPACTS, 4)),
        impacts=np.zeros(joints, dtype=np.int64),
        response=np.zeros(4),
        worn_energy=np.zeros(1),
        steps=np.zeros(2, dtype=np.int64),
    )


@kernel
def bin_of(magnitude):
    """Index of a magnitude's bin: its binary exponent and the first binary digits after it."""
    if not magnitude > 2.0**_FIRST_OCTAVE:
        return 0
    return min((bits_of(magnitude) >> _DIGITS_AFTER_BIN) - _BITS_OF_FIRST, _BINS - 1)


def bin_edge(i: float) -> float:
    """Magnitude at the lower edge of bin i; for a fractional i, inside the bin."""
    octave, inside = divmod(i, _IN_OCTAVE)
    return float(2.0 ** (octave + _FIRST_OCTAVE) * (1.0 + inside / _IN_OCTAVE))


def percentile(seconds: Floats, fraction: float) -> float:
    """Percentile of a histogram: the magnitude below which a fraction of the time was spent.

    Parameters
    ----------
    seconds : (bins,) array
        Time in each bin [s].
    fraction : float
        In [0, 1].

    Returns
    -------
    float
        Exact to the width of a bin, at most 0.8 %; 0 for an empty histogram.
    """
    bins = np.flatnonzero(seconds)  # a few hundred of thousands
    if not len(bins):
        return 0.0
    reached = np.cumsum(seconds[bins])
    sought = fraction * reached[-1]
    at = int(np.searchsorted(reached, sought))
    if not (sought > 0.0 and bins[at] > 0):
        return 0.0
    before = reached[at - 1] if at else 0.0
    return bin_edge(float(bins[at] + (sought - before) / seconds[bins[at]]))


def signed_percentile(seconds: Floats, fraction: float) -> float:
    """Same as `percentile`, for a signed quantity: time (2, bins) [s] at negative and at positive values."""
    below, total = seconds[0].sum(), seconds.sum()
    if not total > 0.0:
        return 0.0
    if fraction * total < below:
        return -percentile(seconds[0], 1.0 - fraction * total / below)
    return percentile(seconds[1], (fraction * total - below) / (total - below))


@kernel
def add_step(statistics, h, weights, rates, drive_rates):
    """Add a step of length h [s] by the quadrature weights of its stages (s,).

    ``rates`` (s, j, 6) and ``drive_rates`` (s, 3) at the stages; the last stage is the step's end.
    """
    statistics.time[0] += h
    for s in range(weights.shape[0]):
        w = h * weights[s]
        if w != 0.0:
            for j in range(rates.shape[1]):
                for r in range(JOINT_RATES):
                    statistics.integral[j, r] += w * rates[s, j, r]
            for r in range(DRIVE_RATES):
                statistics.drive_integral[r] += w * drive_rates[s, r]
    end = weights.shape[0] - 1
    for j in range(rates.shape[1]):
        force = rates[end, j, FORCE]
        statistics.peak[j] = max(statistics.peak[j], force)
        statistics.force_time[j, bin_of(force)] += h
    torque = drive_rates[end, TORQUE]
    statistics.drive_range[0] = min(statistics.drive_range[0], torque)
    statistics.drive_range[1] = max(statistics.drive_range[1], torque)
    statistics.torque_time[1 if torque > 0.0 else 0, bin_of(abs(torque))] += h


@kernel
def begin_impact(impact, impacts, joint, t, speed):
    """Record that contact began in a joint at time t [s] with an approach speed [m/s]."""
    i = impacts[joint]
    impacts[joint] += 1
    if i < IMPACTS:
        impact[joint, i, BEGIN], impact[joint, i, SPEED] = t, speed
        impact[joint, i, END], impact[joint, i, PEAK] = math.nan, 0.0


@kernel
def raise_peak(peak, impact, impacts, joint, force):
    """Update the peak of a joint, and of its present contact, by a normal force [N]."""
    i = impacts[joint] - 1
    peak[joint] = max(peak[joint], force)
    if 0 <= i < IMPACTS and math.isnan(impact[joint, i, END]):
        impact[joint, i, PEAK] = max(impact[joint, i, PEAK], force)


@kernel
def end_impact(impact, impacts, joint, t):
    """Record that the contact in a joint ended at time t [s]."""
    i = impacts[joint] - 1
    if 0 <= i < IMPACTS and math.isnan(impact[joint, i, END]):
        impact[joint, i, END] = t


@kernel
def parabola_peak(t0, f0, t1, f1, t2, f2):
    """Maximum of the parabola through three samples (t [s], f [N]); the middle sample is the largest.

    Just the middle sample where one step is much shorter than the other: wear that is deposited and a change
    of tables are small jumps of the force, and over a very short step (one cut at a contact event) their
    slope would put the vertex at hundreds of kN.
    """
    a, b = t1 - t0, t2 - t1
    if min(a, b) < _MOST_UNEQUAL * max(a, b):
        return f1
    left, right = (f1 - f0) / a, (f2 - f1) / b
    curvature = (right - left) / (a + b)
    if not curvature < 0.0:
        return f1
    slope = (left * b + right * a) / (a + b)
    return f1 - 0.25 * slope * slope / curvature


# Interface between a simulation and a formulation: setup, status codes, samples.


DONE, STEP_TOO_SMALL, SINGULAR, PUSHED_THROUGH, INVALID_DRIVE = 0, 1, 2, 3, 4

_REASONS = {
    STEP_TOO_SMALL: (
        "the integration step became too small; check for a mass, inertia or stiffness far out of range"
    ),
    SINGULAR: "the linkage became singular; check for a dead point, or try smaller clearances",
    PUSHED_THROUGH: (
        "the journal was pushed through a tenth of the bushing's radius; "
        "try a lower speed, a smaller clearance or a higher stiffness"
    ),
    INVALID_DRIVE: "the crank's motion is not finite or far too fast; check its speed and acceleration",
}


@attrs.frozen(eq=False)
class Setup:
    """A leg prepared for a run.

    Attributes
    ----------
    linkage : Linkage
    clearance_joints : tuple of str
        Names of the clearance joints, in the order of ``contacts``.
    contacts : ContactArrays
    bushings : tuple of Bushing
        Bushings of the clearance joints, in the order of the joints.
    surfaces : Surfaces
        Worn surfaces; the run changes them.
    speed : float
        Initial crank speed [rad/s].
    """

    linkage: Linkage
    clearance_joints: tuple[str, ...]
    contacts: ContactArrays
    bushings: tuple[Bushing, ...]
    surfaces: Surfaces
    speed: float


class Sample(NamedTuple):
    """One instant of a run.

    ``toe`` (3, 2): position [m], velocity [m/s] and acceleration [m/s^2], in clearance coordinates their
    deviation from the ideal linkage; zeros without a toe. ``force`` (j,) [N]: in all joints. For k clearance
    joints: ``contact`` (rows, k): rows as in `dynamics.joint`; ``touching`` (k,); ``worn`` (k,) [m]: depth of
    the deepest sector of the bushing.
    """

    crank_angle: float
    toe: Floats
    drive_torque: float
    force: Floats
    contact: Floats
    touching: Flags
    worn: Floats


class Run(Protocol):
    """A run of a leg in some formulation."""

    @property
    def time(self) -> float:
        """Time reached [s]."""

    @property
    def stored_energy(self) -> float:
        """Kinetic energy plus the potential energy of gravity, springs and contacts [J]."""

    def advance(self, t_end: float, statistics: RunStatistics) -> None:
        """Advance to a time [s] and add to run statistics; raises SimulationError if the motion diverges."""

    def sample(self) -> Sample:
        """The present state of the leg."""


def stop(setup: Setup, status: int, k: int, time: float) -> SimulationError:
    """Error for a run that stopped with a status, in clearance joint k (-1 if none), at a time [s]."""
    where = f"joint {setup.clearance_joints[k]} " if k >= 0 else ""
    return SimulationError(
        f"{setup.linkage.mechanism.source}: {where}at t = {time:.6g} s: {_REASONS[status]}"
    )


# The embedded Runge-Kutta pair of order 5(4) of Dormand and Prince 1980, first same as last.


STAGES = 7

NODES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
TABLEAU = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
WEIGHTS = np.array([35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0.0])
# fifth-order minus fourth-order solution
ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])


@kernel
def stage_state(stage, h, y, k, out_y):
    """State at a stage: y + h sum_i a_si k_i; y and out_y (d,), slopes k (7, d), step h [s]."""
    for i in range(y.shape[0]):
        total = 0.0
        for s in range(stage):
            total += TABLEAU[stage, s] * k[s, i]
        out_y[i] = y[i] + h * total


@kernel
def error_norm(h, k, scale):
    """Largest component of the local error over its scale (d,) [-]; infinite if a component is not finite."""
    worst = 0.0
    for i in range(k.shape[1]):
        total = 0.0
        for s in range(STAGES):
            total += ERROR[s] * k[s, i]
        ratio = abs(h * total) / scale[i]
        if not math.isfinite(ratio):
            return math.inf
        worst = max(worst, ratio)
    return worst


@kernel
def next_step(h, error, growth):
    """Next step length [s] after a local error relative to the tolerance; at most ``growth`` times h."""
    if not error < 1.0e12:
        return 0.1 * h
    return h * min(growth, max(0.2, 0.9 * max(error, 1.0e-10) ** -0.2))


@kernel
def hermite(u, h, y0, v0, y1, v1):
    """Value and rate of the cubic Hermite interpolant at the fraction u of a step h [s], from both ends."""
    u2, u3 = u * u, u * u * u
    value = (
        (2 * u3 - 3 * u2 + 1) * y0 + (u3 - 2 * u2 + u) * h * v0 + (3 * u2 - 2 * u3) * y1 + (u3 - u2) * h * v1
    )
    rate = (6 * u2 - 6 * u) * (y0 - y1) / h + (3 * u2 - 4 * u + 1) * v0 + (3 * u2 - 2 * u) * v1
    return value, rate

"""Wear over a leg's life by cycle jumps: the mean wear of a few simulated gait cycles is applied to many.

>>> from leg_wear_monitor import load_mechanism
>>> run = LifeRun(load_mechanism("bionic_leg"), LifeSettings(legs=1, cycles=2), clearances=["A"])
>>> point = run.jump()  # one jump, as often as wanted
>>> life = simulate_life(run, limit_m=3.6e-4, horizon_cycles=1.0e8)
>>> bool(life.cycles[1] == point.cycles < life.cycles_to(0, 3.6e-4) <= life.cycles[-1])
True

If all wear coefficients are larger by one factor, the life is the same but shorter by this factor: wear
depends on coefficient times cycles only.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.configuration import quantity
from leg_wear_monitor.dynamics.clearance.stepper import STATISTICS_INTERVALS, ClearanceStepper, length_of
from leg_wear_monitor.dynamics.clearance.tables import build_tables
from leg_wear_monitor.dynamics.run import (
    ARCHARD,
    DONE,
    RunStatistics,
    Setup,
    new_run_statistics,
    steady_drive,
    stop,
)
from leg_wear_monitor.dynamics.simulation import Leg, advance_batch, prepare_legs
from leg_wear_monitor.errors import ConfigError, SimulationError
from leg_wear_monitor.life.result import Duty, Life
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.loader import limit_fault, suspects
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism, SpeedDrive

# Cycle jumps:the mean wear of a few gait cycles, applied to many cycles (physics.md section 10).
#
# Wear depth over gait cycles obeys an ordinary differential equation. Its right-hand side, the mean wear per
# cycle, has scatter, because single cycles are chaotic. A jump is a step of Heun's method: an Euler step to
# the end, then the mean of the rates at both ends. The difference of both rates beyond their scatter is the
# error.

# step-size control as for ODE solvers: largest growth and shrinkage of a jump, safety factor
_GROWS, _SHRINKS, _SAFETY = 2.0, 0.3, 0.8
_TOLERATED = 0.1  # tolerated error of a jump as a fraction of its deepest change
_SMOOTH_DEG = 5.0  # standard deviation of the window that smooths the rates


@attrs.frozen(eq=False)
class WearRate:
    """Mean wear per gait cycle over n simulated cycles; k clearance joints, N sectors.

    Attributes
    ----------
    depth : (k, 2, N) array, m
        Wear depth of bushing and journal per cycle.
    scatter : (k,) array, m
        Standard error of the growth of the mean clearance per cycle.
    """

    depth: Floats
    scatter: Floats

    @property
    def clearance(self) -> Floats:
        """Growth (k,) of the mean clearance per cycle [m]."""
        return opening(self.depth)


def opening(depth: Floats) -> Floats:
    """Growth (…, k) of the mean clearance [m] by wear of depth (…, k, 2, N) [m]."""
    return np.asarray(depth.mean(axis=-1).sum(axis=-1))


def wear_rate(worn: Floats, smooth_deg: float) -> WearRate:
    """Mean wear per cycle.

    Parameters
    ----------
    worn : (n, k, 2, N) array, m
        Wear depth of each of n cycles.
    smooth_deg : float
        Width of the smoothing window over the angle [deg]: in few cycles, only few sectors have contact. The
        worn volume is conserved.
    """
    growth = opening(worn)
    scatter = growth.std(axis=0, ddof=1) / math.sqrt(len(worn)) if len(worn) > 1 else np.abs(growth[0])
    return WearRate(smoothed(worn.mean(axis=0), smooth_deg), np.asarray(scatter))


def mean_rate(rates: Sequence[WearRate], shares: Floats) -> WearRate:
    """Wear per cycle of a leg that walks a share (n,) of its cycles with each of n rates."""
    variance = weighted(np.array([rate.scatter for rate in rates]) ** 2, shares**2)
    return WearRate(weighted(np.array([rate.depth for rate in rates]), shares), np.sqrt(variance))


def weighted(values: Floats, shares: Floats) -> Floats:
    """Sum (...) of the values (n, ...) times their shares (n,)."""
    return np.asarray(np.tensordot(shares, values, axes=1))


def smoothed(profile: Floats, width_deg: float) -> Floats:
    """Periodic profiles (..., N) smoothed by a Gaussian of a standard deviation [deg]; sums are conserved."""
    n = profile.shape[-1]
    order = np.arange(n // 2 + 1)
    window = np.exp(-0.5 * (order * math.radians(width_deg)) ** 2)
    result = np.fft.irfft(np.fft.rfft(profile, axis=-1) * window, n, axis=-1)
    return np.asarray(np.maximum(result, 0.0) * _ratio(profile, np.maximum(result, 0.0)))


def _ratio(before: Floats, after: Floats) -> Floats:
    """Factors (..., 1) that restore the sum of each profile after negative rounding errors were cut off."""
    sums = after.sum(axis=-1, keepdims=True)
    return np.asarray(before.sum(axis=-1, keepdims=True) / np.where(sums > 0.0, sums, 1.0))


def longest_jump(rate: WearRate, max_wear_m: float) -> float:
    """Largest number of gait cycles of a jump by the change of the surfaces [m]; infinite without wear."""
    deepest = float(rate.depth.sum(axis=1).max(initial=0.0))
    return max_wear_m / deepest if deepest > 0.0 else math.inf


def jump_error(first: WearRate, last: WearRate, cycles: float) -> Floats:
    """Error (k,) [m] of the Euler step in the mean clearance, minus the part that scatter explains.

    The error of Heun's method is smaller, but cannot be estimated from the two rates.
    """
    differ = np.square(last.clearance - first.clearance)
    scatter = np.square(first.scatter) + np.square(last.scatter)
    return np.asarray(0.5 * cycles * np.sqrt(np.maximum(differ - scatter, 0.0)))


def next_jump(cycles: float, error_m: float, tolerance_m: float) -> float:
    """Gait cycles of the next jump, or of the repeated one if its error [m] is above the tolerance [m]."""
    if error_m == 0.0:
        return _GROWS * cycles
    factor = _SAFETY * math.sqrt(tolerance_m / error_m)
    return cycles * min(_GROWS, max(_SHRINKS, factor))


@attrs.frozen(kw_only=True, eq=False)
class LifePoint:
    """A leg at one time of its life; k clearance joints.

    Attributes
    ----------
    cycles : float
        Gait cycles since the life began.
    depth : (k, 2, N) array, m
        Wear of bushing and journal.
    rate : WearRate
        Mean wear per cycle around this time.
    peak_force_n : (k,) array
        Largest contact force of a cycle, mean over the simulated cycles; of a duty the load where it is most.
    rubbing_j_per_cycle : (k,) array
        Integral of ``F_N |v_t| dt`` over a gait cycle, mean over the simulated cycles.
    archard_j : (k,) array
        The same integral since the life began.
    part_growth_m : (parts, k) array
        Growth of the mean clearances per cycle under each load of the duty; one part without a duty.
    error_m : float
        Estimated error of the mean clearance in the jump to this point.
    """

    cycles: float = 0.0
    depth: Floats
    rate: WearRate
    peak_force_n: Floats
    rubbing_j_per_cycle: Floats
    archard_j: Floats
    part_growth_m: Floats
    error_m: float = 0.0

    @property
    def opened_m(self) -> Floats:
        """Growth of the mean clearances (k,) since new [m]."""
        return opening(self.depth)


def life_of(
    clearance_joints: tuple[str, ...],
    fresh_m: Floats,
    points: Sequence[LifePoint],
    period_s: float,
    duty: Duty | None = None,
) -> Life:
    """The life that consists of the given points; parameters as in `Life`."""
    depth = np.array([point.depth for point in points])
    both, sectors = depth.sum(axis=2), depth.shape[-1]
    deepest = (depth[:, :, 0].argmax(axis=2) + 0.5) * (360.0 / sectors)
    return Life(
        clearance_joints=clearance_joints,
        cycles=np.array([point.cycles for point in points]),
        clearance_m=fresh_m + both.mean(axis=2),
        clearance_max_m=fresh_m + both.max(axis=2),
        worst_sector_deg=np.where(depth[:, :, 0].max(axis=2) > 0.0, deepest, np.nan),
        peak_force_n=np.array([point.peak_force_n for point in points]),
        growth_m_per_cycle=np.array([point.rate.clearance for point in points]),
        growth_error_m_per_cycle=np.array([point.rate.scatter for point in points]),
        error_m=np.array([point.error_m for point in points]),
        depth=depth,
        rubbing_j_per_cycle=np.array([point.rubbing_j_per_cycle for point in points]),
        period_s=period_s,
        duty=duty,
        part_growth_m_per_cycle=np.array([point.part_growth_m for point in points]),
    )


# Checks that a life by cycle jumps ends.


MOST_JUMPS = 10_000  # per life; with the default length of a jump, a life takes some 15


def check_can_wear(mechanism: Mechanism, joints: Sequence[str]) -> None:
    """Check that a joint has clearance; raises ConfigError otherwise."""
    if not tuple(joints):
        fault = "no joint has clearance, so nothing can wear"
        raise ConfigError(mechanism.source, "clearances.joints", fault)


def check_life(
    clearance_joints: Sequence[str],
    fresh_m: Floats,
    radius_m: Floats,
    limit_m: ArrayLike,
    max_wear_per_jump_m: float,
) -> None:
    """Check that a life can end.

    Parameters
    ----------
    clearance_joints : sequence of str
    fresh_m, radius_m : (k,) arrays
        Clearances when new, and radii of the bushings.
    limit_m : float or (k,) array
    max_wear_per_jump_m : float
        As in `LifeSettings`.

    Raises
    ------
    ConfigError
        If `simulate_life` refuses the limits or jumps.
    """
    limits = np.broadcast_to(np.asarray(limit_m, dtype=float), len(clearance_joints))
    for joint, fresh, radius, limit in zip(clearance_joints, fresh_m, radius_m, limits, strict=True):
        fault = limit_fault(joint, float(fresh), float(radius), float(limit))
        if fault:
            raise ConfigError("limit-m", "", fault)
    jumps = float((limits - fresh_m).min() / max_wear_per_jump_m)
    if jumps > MOST_JUMPS:
        raise ConfigError(
            "max-wear-per-jump-m",
            "",
            f"{max_wear_per_jump_m:g} m per jump takes {jumps:.2g} jumps to the limit. "
            f"Expected at most {MOST_JUMPS}",
        )


# journals start up to this fraction of the smallest clearance from the centre
_PERTURBED = 0.5
_TRIALS = 4  # attempts to halve a jump before its error is accepted and reported


@attrs.frozen(kw_only=True)
class LifeSettings:
    """Settings of the simulation of a life.

    Attributes
    ----------
    legs : int
        Number of legs whose wear is averaged; they differ only in their start.
    cycles : int
        Gait cycles of each leg that are averaged before a jump.
    settle_cycles : int
        Gait cycles before the averaged ones, because the surfaces have changed.
    max_wear_per_jump_m : float
        Deepest change of a surface that a jump may make [m]; its error may be a tenth of that.
    seed : int
        Seed of the legs' start positions.
    """

    legs: int = quantity(
        "", "legs whose wear is averaged; they differ in their start only", at_least=1, default=2
    )
    cycles: int = quantity("", "gait cycles per leg that are averaged before a jump", at_least=2, default=4)
    settle_cycles: int = quantity(
        "", "gait cycles to settle on the changed surfaces before that", at_least=0, default=1
    )
    max_wear_per_jump_m: float = quantity(
        "m", "deepest change of a surface that a jump may make", above=0.0, default=3.0e-5
    )
    seed: int = quantity("", "seed of the starts", at_least=0, default=0)


class LifeRun:
    """A leg at some time of its life, advanced by cycle jumps.

    Parameters
    ----------
    mechanism : Mechanism
    settings : LifeSettings, optional
    clearances : sequence of str, optional
        Names of the clearance joints; the mechanism's own if not given.
    clearance_m, speed_rpm : float, optional
        The mechanism's own if not given.
    wear_factor : float or (k,) array
        Factor on the wear coefficients of the clearance joints.
    depth : (k, 2, N) array, optional
        Initial wear [m]; none if not given.
    workers : int, optional
        Number of threads; default: the number of cores.
    duty : Duty, optional
        Loads under which the leg walks: the wear of a gait cycle is the mean over them by their hours. The
        mechanism's own loads if not given.

    Attributes
    ----------
    clearance_joints : tuple of str
    fresh_m, radius_m : (k,) arrays
        Radial clearances without wear, and radii of the bushings.
    settings : LifeSettings
    points : list of LifePoint
        The life so far; the first point is its begin.

    Raises
    ------
    ConfigError, AssemblyError
    """

    def __init__(
        self,
        mechanism: Mechanism,
        settings: LifeSettings | None = None,
        *,
        clearances: Sequence[str] | None = None,
        clearance_m: float | None = None,
        speed_rpm: float | None = None,
        wear_factor: ArrayLike = 1.0,
        depth: Floats | None = None,
        workers: int | None = None,
        duty: Duty | None = None,
    ) -> None:
        self.settings = settings or LifeSettings()
        self._workers, self._duty = workers, duty
        self._shares = duty.shares if duty else np.ones(1)
        check_can_wear(mechanism, mechanism.clearance_joints if clearances is None else clearances)
        alike = Leg(
            mechanism=mechanism,
            clearances=clearances,
            clearance_m=clearance_m,
            speed_rpm=speed_rpm,
            wear=True,
        )
        loaded = duty.mechanisms(_turned(mechanism, speed_rpm)) if duty else [mechanism]
        legs = [
            leg for one in loaded for leg in _spread_out(attrs.evolve(alike, mechanism=one), self.settings)
        ]
        self._setups = _setups(legs, wear_factor)
        first = self._setups[0]
        self.clearance_joints, self.fresh_m = first.clearance_joints, first.contacts.clearance
        self.radius_m = first.contacts.bushing_radius
        # legs under the same load share their tables, which are large
        tables = [build_tables(each.linkage, each.contacts) for each in self._setups[:: self.settings.legs]]
        self._steppers = [
            ClearanceStepper(
                setup, length_of(setup, STATISTICS_INTERVALS), tables=tables[i // self.settings.legs]
            )
            for i, setup in enumerate(self._setups)
        ]
        self._polynomials = []
        perturb_m = _PERTURBED * float(self.fresh_m.min())
        for leg, stepper in zip(legs, self._steppers, strict=True):
            attrs.evolve(leg, perturb_m=perturb_m).start(stepper)
            self._polynomials.append(steady_drive(leg.crank_angle_rad, first.speed))
        start = np.zeros_like(first.surfaces.depth) if depth is None else depth.copy()
        now = self._now = self._probe(start)
        self._wish = longest_jump(now.rate, self.settings.max_wear_per_jump_m)
        self.points = [now]

    def jump(self, most_cycles: float = np.inf) -> LifePoint:
        """Advance by one jump of at most so many gait cycles.

        Raises
        ------
        SimulationError
            If the motion diverges.
        """
        most_m, last, now = self.settings.max_wear_per_jump_m, self.points[-1], self._now
        tolerance_m, cycles = (
            _TOLERATED * most_m,
            min(self._wish, longest_jump(now.rate, most_m), most_cycles),
        )
        for trial in range(_TRIALS):
            then = self._probe(last.depth + cycles * now.rate.depth)
            error = float(jump_error(now.rate, then.rate, cycles).max())
            wish = next_jump(cycles, error, tolerance_m)
            if error <= tolerance_m or trial == _TRIALS - 1:
                break
            cycles = wish
        point = attrs.evolve(
            then,
            cycles=last.cycles + cycles,
            depth=last.depth + 0.5 * cycles * (now.rate.depth + then.rate.depth),
            archard_j=last.archard_j + 0.5 * cycles * (now.rubbing_j_per_cycle + then.rubbing_j_per_cycle),
            error_m=error,
        )
        self._now, self._wish = then, wish
        self.points.append(point)
        return point

    def hold(self, k: int) -> None:
        """Stop the wear of joint k, as if its part were replaced before its clearance grows further."""
        depth = self._now.rate.depth.copy()
        depth[k] = 0.0
        part_growth_m = self._now.part_growth_m.copy()
        part_growth_m[:, k] = 0.0
        rate = attrs.evolve(self._now.rate, depth=depth)
        self._now = attrs.evolve(self._now, rate=rate, part_growth_m=part_growth_m)
        for setup in self._setups:
            setup.contacts.wear_coefficient[k] = 0.0

    @property
    def life(self) -> Life:
        """The life so far."""
        period_s = TURN / abs(self._setups[0].speed)
        return life_of(self.clearance_joints, self.fresh_m, self.points, period_s, self._duty)

    def _probe(self, depth: Floats) -> LifePoint:
        """Simulate a few cycles with surfaces (k, 2, N) [m]; their mean under all loads of the duty."""
        for setup in self._setups:
            setup.surfaces.depth[:] = depth
        self._advance(self.settings.settle_cycles)
        worn, archard, peak = [], [], []
        for _ in range(self.settings.cycles):
            before = [setup.surfaces.depth.copy() for setup in self._setups]
            statistics_of_all = self._advance(1)
            joints = self._setups[0].contacts.joint
            worn.append([setup.surfaces.depth - was for setup, was in zip(self._setups, before, strict=True)])
            archard.append([statistics.integral[joints, ARCHARD] for statistics in statistics_of_all])
            peak.append([statistics.peak[joints] for statistics in statistics_of_all])
        rates = [wear_rate(one, _SMOOTH_DEG) for one in self._by_part(worn)]
        return LifePoint(
            depth=depth,
            rate=mean_rate(rates, self._shares),
            peak_force_n=self._by_part(peak).mean(axis=1).max(axis=0),
            rubbing_j_per_cycle=weighted(self._by_part(archard).mean(axis=1), self._shares),
            part_growth_m=np.array([rate.clearance for rate in rates]),
            archard_j=np.zeros(len(self.clearance_joints)),
        )

    def _by_part(self, values: list[list[Any]]) -> Floats:
        """Values of each cycle and leg by part of the duty (parts, cycles of all its legs, ...)."""
        of_all = np.array(values)
        apart = of_all.reshape(len(of_all), len(self._shares), -1, *of_all.shape[2:])
        return np.moveaxis(apart, 1, 0).reshape(len(self._shares), -1, *of_all.shape[2:])

    def _advance(self, cycles: int) -> list[RunStatistics]:
        joints = len(self._setups[0].linkage.mechanism.joints)
        statistics_of_all = [new_run_statistics(joints) for _ in self._steppers]
        period = TURN / abs(self._setups[0].speed)
        ends = [(round(stepper.time / period) + cycles) * period for stepper in self._steppers]
        outcomes = advance_batch(self._steppers, self._polynomials, ends, statistics_of_all, self._workers)
        for (status, k), setup, stepper in zip(outcomes, self._setups, self._steppers, strict=True):
            if status != DONE:
                stopped = stop(setup, status, k, stepper.time)
                raise SimulationError(f"{stopped}{suspects(setup.linkage.mechanism)}")
        return statistics_of_all


def simulate_life(
    run: LifeRun,
    *,
    limit_m: ArrayLike,
    horizon_cycles: float,
    progress: Callable[[float], None] | None = None,
) -> Life:
    """Advance until a mean clearance reaches its limit, or to a horizon.

    Parameters
    ----------
    run : LifeRun
        Continued from its present state.
    limit_m : float or (k,) array
        Limit of the mean radial clearance of each clearance joint.
    horizon_cycles : float
        Largest number of gait cycles since the run began.
    progress : callable, optional
        Called with the completed fraction.

    Raises
    ------
    ConfigError
        If a limit does not lie between a joint's new clearance and the radius of its bushing, or if the run's
        jumps are too short to reach it.
    SimulationError
        If the motion diverges, or the life takes more than `MOST_JUMPS` jumps.
    """
    limits = np.broadcast_to(np.asarray(limit_m, dtype=float), len(run.clearance_joints))
    check_life(run.clearance_joints, run.fresh_m, run.radius_m, limits, run.settings.max_wear_per_jump_m)
    while run.points[-1].cycles < horizon_cycles:
        if len(run.points) > MOST_JUMPS:
            raise SimulationError(
                f"the life does not end within {MOST_JUMPS} jumps, it has "
                f"reached {run.points[-1].cycles:.3g} "
                f"of {horizon_cycles:.3g} gait cycles; use longer jumps or a smaller limit"
            )
        opened = run.points[-1].opened_m
        fractions = opened / (limits - run.fresh_m)
        if (fractions >= 1.0).any():
            break
        if not run.points[-1].rate.clearance.max() > 0.0:
            break
        run.jump(horizon_cycles - run.points[-1].cycles)
        if progress:
            progress(float(min(1.0, max(fractions.max(), run.points[-1].cycles / horizon_cycles))))
    return run.life


def _turned(mechanism: Mechanism, speed_rpm: float | None) -> Mechanism:
    """The mechanism with its drive turning in the direction of a speed, such as a stance's speed."""
    drive = mechanism.drive
    if speed_rpm is None or not isinstance(drive, SpeedDrive):
        return mechanism
    return attrs.evolve(mechanism, drive=attrs.evolve(drive, speed=math.copysign(drive.speed, speed_rpm)))


def _spread_out(leg: Leg, settings: LifeSettings) -> list[Leg]:
    """Equal legs with different initial states."""
    return [
        attrs.evolve(leg, crank_angle_rad=TURN * (i + 0.5) / settings.legs, seed=settings.seed + i)
        for i in range(settings.legs)
    ]


def _setups(legs: Sequence[Leg], wear_factor: ArrayLike) -> list[Setup]:
    setups = []
    for setup in prepare_legs(legs):
        factor = np.broadcast_to(np.asarray(wear_factor, dtype=float), len(setup.clearance_joints))
        coefficient = setup.contacts.wear_coefficient * factor[:, None]
        setups.append(attrs.evolve(setup, contacts=setup.contacts._replace(wear_coefficient=coefficient)))
    return setups


def life_document(life: Life, limit_m: float) -> dict[str, Any]:
    """Plain object for JSON; with a duty, it also contains the time when each joint reaches the limit."""
    if life.duty is None:
        return life.to_dict()
    return {
        **life.to_dict(),
        "duty": {**life.duty.to_dict(), "limit_m": limit_m, "end": life.end(limit_m)},
    }

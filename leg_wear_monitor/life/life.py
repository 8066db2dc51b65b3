"""Wear over a leg's life by cycle jumps: the mean wear of a few simulated gait cycles is applied to many.

>>> from leg_wear_monitor import load_mechanism
>>> run = LifeRun(load_mechanism("bionic_leg"), LifeSettings(legs=1, cycles=2), clearances=["A"])
>>> point = run.jump()  # one jump, as often as wanted
>>> life = simulate_life(run, limit_m=3.6e-4, horizon_cycles=1.0e8)
>>> bool(life.cycles[1] == point.cycles < life.cycles_to(0, 3.6e-4) <= life.cycles[-1])
True

If all wear coefficients are larger by one factor, the life is the same but shorter by this factor: wear
depends on coefficient times cycles only. See `monitor.forecast` for different coefficients.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.configuration.quantity import described, quantity
from leg_wear_monitor.dynamics.batch.batch import advance_batch
from leg_wear_monitor.dynamics.batch.leg import Leg, prepare_legs, share_tables
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.run.drive import steady_drive
from leg_wear_monitor.dynamics.run.protocol import DONE, Setup, stop
from leg_wear_monitor.dynamics.run.run_statistics import ARCHARD, RunStatistics, new_run_statistics
from leg_wear_monitor.errors import ConfigError, SimulationError
from leg_wear_monitor.life.duty import Duty
from leg_wear_monitor.life.limits import MOST_JUMPS, check_life
from leg_wear_monitor.life.result import Life, LifePoint, life_of
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.materials.of_joints import check_wear_is_known
from leg_wear_monitor.mechanism.plausible import suspects
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.wear.cycle_jump import (
    JumpControl,
    WearRate,
    jump_error,
    longest_jump,
    mean_rate,
    next_jump,
    wear_rate,
    weighted,
)

_TRIALS = 4  # of a jump with too large an error, before it is accepted and reported


@attrs.frozen(kw_only=True)
class LifeSettings:
    """How a life is simulated.

    Attributes
    ----------
    legs : int
        Legs whose wear is averaged, alike but for their start.
    cycles : int
        Gait cycles of each leg that are averaged before a jump.
    settle_cycles : int
        Gait cycles before those, since the surfaces have changed.
    perturb_fraction : float
        Journals start up to this fraction of the smallest clearance from the centre.
    jump : JumpControl
        How far a jump may go: deepest change of a surface ``opens_m`` and error ``tolerance_m`` [m].
    seed : int
        Of where the legs start.
    """

    legs: int = quantity("", "legs whose wear is averaged, alike but for their start", at_least=1, default=2)
    cycles: int = quantity("", "gait cycles of each that are averaged, before a jump", at_least=2, default=4)
    settle_cycles: int = quantity(
        "", "gait cycles before those, since the surfaces have changed", at_least=0, default=1
    )
    perturb_fraction: float = quantity(
        "",
        "journals start up to this fraction of the smallest clearance from the centre",
        at_least=0.0,
        at_most=1.0,
        default=0.5,
    )
    jump: JumpControl = described("how far a jump may go", factory=JumpControl)
    seed: int = quantity("", "of where legs start", at_least=0, default=0)


class _Probe(NamedTuple):
    """Mean of the cycles simulated at one state of wear and under all loads of the duty, for `LifePoint`."""

    rate: WearRate
    part_growth_m: Floats
    archard_j: Floats
    peak_force_n: Floats
    toe_position_m: float


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
    workers : int
        Number of threads.
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
        workers: int = 1,
        duty: Duty | None = None,
    ) -> None:
        self.settings = settings or LifeSettings()
        self._workers, self._duty = workers, duty
        self._shares = duty.shares if duty else np.ones(1)
        check_wear_is_known(mechanism, mechanism.clearance_joints if clearances is None else clearances)
        alike = Leg(
            mechanism=mechanism,
            clearances=clearances,
            clearance_m=clearance_m,
            speed_rpm=speed_rpm,
            wear=True,
        )
        loaded = duty.mechanisms(mechanism) if duty else [mechanism]
        legs = [
            leg for one in loaded for leg in _spread_out(attrs.evolve(alike, mechanism=one), self.settings)
        ]
        self._setups = _setups(legs, wear_factor)
        first = self._setups[0]
        if not first.clearance_joints:
            raise ConfigError(
                mechanism.source, "clearances.joints", "no joint has clearance, nothing can wear"
            )
        self.clearance_joints, self.fresh_m = first.clearance_joints, first.contacts.clearance
        self.radius_m = first.contacts.bushing_radius
        self._steppers = [
            ClearanceStepper(setup, tables=tables.get()) for _, setup, tables in share_tables(self._setups)
        ]
        self._polynomials = []
        perturb_m = self.settings.perturb_fraction * float(self.fresh_m.min())
        for leg, stepper in zip(legs, self._steppers, strict=True):
            attrs.evolve(leg, perturb_m=perturb_m).start(stepper)
            self._polynomials.append(steady_drive(leg.crank_angle_rad, first.speed))
        start = np.zeros_like(first.surfaces.depth) if depth is None else depth.copy()
        now = self._now = self._probe(start)
        self._wish = longest_jump(now.rate, self.settings.jump)
        self.points = [self._point(0.0, start, np.zeros_like(now.archard_j), 0.0)]

    def jump(self, most_cycles: float = np.inf) -> LifePoint:
        """Advance by one jump of at most so many gait cycles.

        Raises
        ------
        SimulationError
            If the motion diverges.
        """
        control, last, now = self.settings.jump, self.points[-1], self._now
        cycles = min(self._wish, longest_jump(now.rate, control), most_cycles)
        for trial in range(_TRIALS):
            then = self._probe(last.depth + cycles * now.rate.depth)
            error = float(jump_error(now.rate, then.rate, cycles).max())
            wish = next_jump(cycles, error, control)
            if error <= control.tolerance_m or trial == _TRIALS - 1:
                break
            cycles = wish
        depth = last.depth + 0.5 * cycles * (now.rate.depth + then.rate.depth)
        worked = last.archard_j + 0.5 * cycles * (now.archard_j + then.archard_j)
        self._now, self._wish = then, wish
        self.points.append(self._point(last.cycles + cycles, depth, worked, error))
        return self.points[-1]

    def hold(self, k: int) -> None:
        """Stop the wear of joint k, as if its part were replaced before its clearance grows further."""
        depth = self._now.rate.depth.copy()
        depth[k] = 0.0
        part_growth_m = self._now.part_growth_m.copy()
        part_growth_m[:, k] = 0.0
        rate = attrs.evolve(self._now.rate, depth=depth)
        self._now = self._now._replace(rate=rate, part_growth_m=part_growth_m)
        for setup in self._setups:
            setup.contacts.wear_coefficient[k] = 0.0

    @property
    def life(self) -> Life:
        """The life so far."""
        period_s = TURN / abs(self._setups[0].speed)
        return life_of(self.clearance_joints, self.fresh_m, self.points, period_s, self._duty)

    def _point(self, cycles: float, depth: Floats, archard_j: Floats, error_m: float) -> LifePoint:
        """The present state of wear, after a jump."""
        now = self._now
        return LifePoint(
            cycles=cycles,
            depth=depth,
            rate=now.rate,
            peak_force_n=now.peak_force_n,
            toe_position_m=now.toe_position_m,
            archard_j=archard_j,
            error_m=error_m,
            rubbing_j_per_cycle=now.archard_j,
            part_growth_m=now.part_growth_m,
        )

    def _probe(self, depth: Floats) -> _Probe:
        """Simulate a few cycles with surfaces (k, 2, N) [m]."""
        for setup in self._setups:
            setup.surfaces.depth[:] = depth
        self._advance(self.settings.settle_cycles)
        worn, archard, peak, toe = [], [], [], []
        for _ in range(self.settings.cycles):
            before = [setup.surfaces.depth.copy() for setup in self._setups]
            statistics_of_all = self._advance(1)
            joints = self._setups[0].contacts.joint
            worn.append([setup.surfaces.depth - was for setup, was in zip(self._setups, before, strict=True)])
            archard.append([statistics.integral[joints, ARCHARD] for statistics in statistics_of_all])
            peak.append([statistics.peak[joints] for statistics in statistics_of_all])
            toe.append([statistics.response[0] for statistics in statistics_of_all])
        smooth_deg = self.settings.jump.smooth_deg
        rates = [wear_rate(one, smooth_deg) for one in self._by_part(worn)]
        return _Probe(
            mean_rate(rates, self._shares),
            np.array([rate.clearance for rate in rates]),
            weighted(self._by_part(archard).mean(axis=1), self._shares),
            self._by_part(peak).mean(axis=1).max(axis=0),
            float(self._by_part(toe).mean(axis=1).max()),
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
        Where the motion diverges, or if the life takes more than `MOST_JUMPS` jumps.
    """
    limits = np.broadcast_to(np.asarray(limit_m, dtype=float), len(run.clearance_joints))
    check_life(run.clearance_joints, run.fresh_m, run.radius_m, limits, run.settings.jump)
    while run.points[-1].cycles < horizon_cycles:
        if len(run.points) > MOST_JUMPS:
            raise SimulationError(
                f"the life does not end within {MOST_JUMPS} jumps, it is at {run.points[-1].cycles:.3g} "
                f"of {horizon_cycles:.3g} gait cycles; try longer jumps or a nearer limit"
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


def _spread_out(leg: Leg, settings: LifeSettings) -> list[Leg]:
    """Equal legs with different initial states."""
    return [
        attrs.evolve(leg, crank_angle_rad=TURN * (i + 0.5) / settings.legs, seed=settings.seed + i)
        for i in range(settings.legs)
    ]


def _setups(legs: Sequence[Leg], wear_factor: ArrayLike) -> list[Setup]:
    setups = []
    for setup in prepare_legs(legs):
        if not isinstance(setup, Setup):
            raise setup
        factor = np.broadcast_to(np.asarray(wear_factor, dtype=float), len(setup.clearance_joints))
        coefficient = setup.contacts.wear_coefficient * factor[:, None]
        setups.append(attrs.evolve(setup, contacts=setup.contacts._replace(wear_coefficient=coefficient)))
    return setups

"""Many independent legs in parallel threads, for lives.

Every leg has its own state and run statistics, and the compiled code releases the interpreter's lock. Threads
therefore run in parallel and share the tables; results do not depend on the number of threads.
"""

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.dynamics.clearance.stepper import (
    ClearanceStepper,
    needs_speed,
)
from leg_wear_monitor.dynamics.run import RunStatistics, Setup
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism, SpeedDrive
from leg_wear_monitor.wear import fresh_surfaces

# Preparation of the legs of a batch: initial states and shared tables.


@attrs.frozen(kw_only=True, eq=False)
class Leg:
    """One leg of a batch; fields in common with the parameters of `simulate` have the same meaning.

    Attributes
    ----------
    mechanism : Mechanism
    clearances : sequence of str, optional
    clearance_m, speed_rpm : float, optional
    normal_law : str, optional
    wear : bool
    crank_angle_rad : float
        Initial crank angle; cycles are counted from there.
    perturb_m : float
        Largest initial eccentricity; initial positions of the journals are uniform over this disc.
    seed : int
        Seed of the initial positions.
    """

    mechanism: Mechanism
    clearances: Sequence[str] | None = None
    clearance_m: float | None = None
    speed_rpm: float | None = None
    normal_law: str | None = None
    wear: bool = False
    crank_angle_rad: float = 0.0
    perturb_m: float = 0.0
    seed: int = 0

    def prepare(self) -> Setup:
        """Setup of the leg.

        Raises
        ------
        ConfigError
            If a value is invalid.
        AssemblyError
            If the linkage does not close or has a dead point.
        """
        setup = prepare(
            self.mechanism,
            clearances=self.clearances,
            clearance_m=self.clearance_m,
            speed_rpm=self.speed_rpm,
            wear=self.wear,
            normal_law=self.normal_law,
        )
        if not isinstance(self.mechanism.drive, SpeedDrive):
            raise needs_speed(self.mechanism)
        smallest = setup.contacts.clearance.min(initial=math.inf)
        if not 0.0 <= self.perturb_m <= smallest:
            raise ConfigError(
                "perturb_m", "", f"{self.perturb_m} m is not from 0 to the smallest clearance, {smallest:g} m"
            )
        return setup

    def start(self, stepper: ClearanceStepper) -> None:
        """Set a stepper of this leg to the leg's initial state."""
        stepper.init(self.crank_angle_rad, stepper.speed)
        chance = np.random.default_rng(self.seed)
        joints = len(stepper.eccentricity)
        away = self.perturb_m * np.sqrt(chance.random(joints))
        direction = TURN * chance.random(joints)
        stepper.set_eccentricities(np.stack([away * np.cos(direction), away * np.sin(direction)], axis=1))


def prepare_legs(legs: Sequence[Leg]) -> list[Setup]:
    """Setups of the legs.

    Legs that differ only in their initial state are prepared once; each setup has its own surfaces.

    Raises
    ------
    ConfigError
        If a value is invalid.
    AssemblyError
        If a linkage does not close or has a dead point.
    """
    known: dict[str, Setup] = {}
    setups = []
    for leg in legs:
        # The key is a dict, because the text of a mechanism leaves out materials and labels that results
        # name.
        key = repr(attrs.asdict(attrs.evolve(leg, crank_angle_rad=0.0, seed=0)))
        if key not in known:
            known[key] = leg.prepare()
        setup = known[key]
        setups.append(attrs.evolve(setup, surfaces=fresh_surfaces(setup.contacts, leg.wear)))
    return setups


def advance_batch(
    steppers: Sequence[ClearanceStepper],
    polynomials: Sequence[Floats],
    t_end: ArrayLike,
    statistics_of_all: Sequence[RunStatistics],
    workers: int | None = None,
) -> list[tuple[int, int]]:
    """Advance many steppers, each to its own time, and add to their run statistics.

    Parameters
    ----------
    steppers : sequence of n ClearanceStepper
        Each with its own setup, because steppers of one setup share their surfaces.
    polynomials : sequence of n arrays (7,)
        Motions of the cranks, as in `ClearanceStepper.advance`.
    t_end : float or (n,) array, s
    statistics_of_all : sequence of n RunStatistics
    workers : int, optional
        Number of threads; default: the number of cores.

    Returns
    -------
    list of (status, k)
        Status of each stepper, as in `ClearanceStepper.advance`; a failed stepper does not stop the rest.

    Raises
    ------
    ValueError
        If the lengths differ, or a state or run statistics occur twice.
    """
    for what in (
        [stepper.state.depth for stepper in steppers],
        [statistics.time for statistics in statistics_of_all],
    ):
        if len({id(array) for array in what}) < len(what):
            raise ValueError("two legs of a batch share their surfaces or their run statistics")
    times = np.broadcast_to(np.asarray(t_end, dtype=float), len(steppers)).tolist()
    jobs = list(zip(steppers, polynomials, times, statistics_of_all, strict=True))
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        return list(pool.map(lambda job: job[0].advance(*job[1:]), jobs))

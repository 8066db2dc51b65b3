"""Preparation of the legs of a batch: initial states and shared tables."""

import math
from collections.abc import Iterator, Sequence
from threading import Lock

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.basis import Basis
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper, needs_speed
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables, build_basis, build_tables
from leg_wear_monitor.dynamics.run.protocol import Setup
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.errors import AssemblyError, ConfigError
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism, SpeedDrive
from leg_wear_monitor.wear.surfaces import fresh_surfaces


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
        Initial crank angle, from which cycles are counted.
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
            For invalid values.
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


def prepare_legs(legs: Sequence[Leg]) -> list[Setup | AssemblyError]:
    """Setups of the legs; an AssemblyError in place of the setup if a linkage does not close or turn.

    Legs that differ only in their initial state are prepared once; each setup has its own surfaces.

    Raises
    ------
    ConfigError
        For invalid values.
    """
    known: dict[str, Setup | AssemblyError] = {}
    setups = []
    for leg in legs:
        key = repr(attrs.evolve(leg, crank_angle_rad=0.0, seed=0))
        if key not in known:
            try:
                known[key] = leg.prepare()
            except AssemblyError as error:
                known[key] = error
        setup = known[key]
        if isinstance(setup, Setup):
            setup = attrs.evolve(setup, surfaces=fresh_surfaces(setup.contacts, leg.wear))
        setups.append(setup)
    return setups


class SharedBasis:
    """Basis of the tables of legs that differ in radii, contacts, speed and initial state only.

    Parameters
    ----------
    setup : Setup
        Setup of any of these legs.
    """

    def __init__(self, setup: Setup) -> None:
        self._lock, self._setup = Lock(), setup
        self._basis: Basis | None = None

    def get(self) -> Basis:
        """The basis; the first call builds it, other threads wait meanwhile."""
        with self._lock:
            if self._basis is None:
                self._basis = build_basis(self._setup.linkage, self._setup.contacts)
            return self._basis


class SharedTables:
    """Tables of a group of legs, built when the first of them runs.

    Parameters
    ----------
    setup : Setup
        Setup of any leg of the group.
    basis : SharedBasis, optional
        That of this group and of others.
    """

    def __init__(self, setup: Setup, basis: SharedBasis | None = None) -> None:
        self._lock, self._setup, self._basis = Lock(), setup, basis
        self._tables: ClearanceTables | None = None

    def get(self) -> ClearanceTables:
        """The tables; the first call builds them, other threads wait meanwhile."""
        with self._lock:
            if self._tables is None:
                basis = self._basis.get() if self._basis else None
                self._tables = build_tables(self._setup.linkage, self._setup.contacts, basis=basis)
                self._basis = None
            return self._tables


def share_tables(setups: Sequence[Setup | AssemblyError]) -> Iterator[tuple[int, Setup, SharedTables]]:
    """Index, setup and tables of the valid legs; legs with common tables, then bases, follow each other.

    Therefore no more tables and bases exist at a time than legs are running.
    """
    groups: dict[object, dict[object, list[tuple[int, Setup]]]] = {}
    for i, setup in enumerate(setups):
        if isinstance(setup, Setup):
            mechanism, contacts = setup.linkage.mechanism, setup.contacts
            bare = repr(attrs.evolve(mechanism, clearances={}, clearance_joints=()))
            radii = contacts.bushing_radius.tobytes(), contacts.clearance.tobytes()
            group = groups.setdefault((bare, setup.clearance_joints), {})
            group.setdefault(radii, []).append((i, setup))
    for group in groups.values():
        (first, *_), *others = group.values()
        basis = SharedBasis(first[1]) if others else None
        for legs in group.values():
            tables = SharedTables(legs[0][1], basis)
            for i, setup in legs:
                yield i, setup, tables

"""The legs of an ensemble: alike but for where crank and journals start, and the same for every point."""

from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.contact.arrays import clearance_settings
from leg_wear_monitor.dynamics.batch.leg import Leg, prepare_legs
from leg_wear_monitor.dynamics.clearance.tables import build_tables
from leg_wear_monitor.dynamics.run.protocol import Setup
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.tasks.contact_watch import ObservedLeg
from leg_wear_monitor.studies.tasks.grid import SAMPLES


def with_friction(mechanism: Mechanism, changes: dict[str, Any]) -> Mechanism:
    """The mechanism with other friction in all its joints; fields of `mechanism.clearance.Friction`."""
    clearances = {
        name: attrs.evolve(own, friction=attrs.evolve(own.friction, **changes))
        for name, own in mechanism.clearances.items()
    }
    return attrs.evolve(mechanism, clearances=clearances)


def start_angles(runs: int, seed: int) -> list[float]:
    """Crank angles [rad] at which runs start: on the grid of samples, one in each equal part of a turn."""
    chance = np.random.default_rng([seed, 1])
    steps = (SAMPLES * (np.arange(runs) + chance.random(runs)) / runs).astype(int)
    return [float(step) * (TURN / SAMPLES) for step in steps]


def ensemble(mechanism: Mechanism, settings: dict[str, Any]) -> list[Leg]:
    """Legs that differ in where they start.

    Parameters
    ----------
    mechanism : Mechanism
    settings : dict
        ``clearance_joints``, ``clearance_m``, ``speed_rpm``, ``runs``, ``seed``, ``perturb_fraction``;
        optional ``normal_law`` and ``friction``.
    """
    if settings.get("friction"):
        mechanism = with_friction(mechanism, settings["friction"])
    clearance_joints, clearance_m = settings["clearance_joints"], settings["clearance_m"]
    smallest = min(c.radial_clearance for c in clearance_settings(mechanism, clearance_joints, clearance_m))
    return [
        Leg(
            mechanism=mechanism,
            clearances=clearance_joints,
            clearance_m=clearance_m,
            speed_rpm=settings["speed_rpm"],
            normal_law=settings.get("normal_law"),
            crank_angle_rad=angle,
            perturb_m=settings["perturb_fraction"] * smallest,
            seed=settings["seed"] + member,
        )
        for member, angle in enumerate(start_angles(settings["runs"], settings["seed"]))
    ]


def watch(legs: list[Leg], tolerance_m: float | None = None) -> list[ObservedLeg]:
    """Every leg where it starts; they share their tables.

    Raises
    ------
    AssemblyError
        For a leg that cannot turn.
    """
    setups: list[Setup] = []
    for setup in prepare_legs(legs):
        if not isinstance(setup, Setup):
            raise setup
        setups.append(setup)
    tables = build_tables(setups[0].linkage, setups[0].contacts)
    return [ObservedLeg(leg, setup, tables, tolerance_m) for leg, setup in zip(legs, setups, strict=True)]


def check_points(mechanism: Mechanism, settings: list[dict[str, Any]]) -> None:
    """Prepare every distinct leg, so that what cannot be is told before anything runs; raises ConfigError."""
    for each in settings:
        leg = ensemble(mechanism, each | {"runs": 1})[0]
        if not leg.clearances:
            raise ConfigError("joints", "", "names no joint")
        leg.prepare()

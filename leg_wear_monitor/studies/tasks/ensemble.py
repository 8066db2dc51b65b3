"""Ensembles: legs with equal parameters that differ in the initial positions of crank and journals."""

from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.configuration.quantity import FieldError
from leg_wear_monitor.contact.arrays import clearance_settings
from leg_wear_monitor.dynamics.batch.leg import Leg, prepare_legs
from leg_wear_monitor.dynamics.clearance.tables import build_tables
from leg_wear_monitor.dynamics.run.protocol import Setup
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.clearance import Film
from leg_wear_monitor.mechanism.ground_reaction import on_the_ground
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.tasks.grid import SAMPLES
from leg_wear_monitor.studies.tasks.observed_leg import ObservedLeg


def with_friction(mechanism: Mechanism, changes: dict[str, Any]) -> Mechanism:
    """The mechanism with changed fields of `mechanism.clearance.Friction` in all its joints."""
    clearances = {
        name: attrs.evolve(own, friction=attrs.evolve(own.friction, **changes))
        for name, own in mechanism.clearances.items()
    }
    return attrs.evolve(mechanism, clearances=clearances)


def with_film(mechanism: Mechanism, film: dict[str, float]) -> Mechanism:
    """The mechanism with a film, fields of `mechanism.clearance.Film`, in all its joints.

    Raises
    ------
    ConfigError
        If a joint cannot have this film.
    """
    clearances = {}
    for name, own in mechanism.clearances.items():
        try:
            clearances[name] = attrs.evolve(own, film=Film(**film))
        except FieldError as error:
            where = f"clearances.joints.{name}.{error.key}"
            raise ConfigError(mechanism.source, where, error.fault) from error
    return attrs.evolve(mechanism, clearances=clearances)


def loaded(mechanism: Mechanism, settings: dict[str, Any]) -> Mechanism:
    """The mechanism under the force of the ground, its vertical peak ``ground_n`` [N] if that is given."""
    return on_the_ground(mechanism, settings["ground_n"]) if settings.get("ground_n") else mechanism


def start_angles(runs: int, seed: int) -> list[float]:
    """Initial crank angles [rad] of the runs: on the sampling grid, one in each equal part of a turn."""
    chance = np.random.default_rng([seed, 1])
    steps = (SAMPLES * (np.arange(runs) + chance.random(runs)) / runs).astype(int)
    return [float(step) * (TURN / SAMPLES) for step in steps]


def ensemble(mechanism: Mechanism, settings: dict[str, Any]) -> list[Leg]:
    """Legs that differ in their initial positions.

    Parameters
    ----------
    mechanism : Mechanism
    settings : dict
        ``clearance_joints``, ``clearance_m`` [m], ``speed_rpm``, ``runs``, ``seed``, ``perturb_fraction`` (of
        the smallest clearance); optional ``normal_law``, ``friction``, ``film`` and ``ground_n`` [N].

    Returns
    -------
    list of Leg
        One for each run.
    """
    if settings.get("film"):
        mechanism = with_film(mechanism, settings["film"])
    if settings.get("friction"):
        mechanism = with_friction(mechanism, settings["friction"])
    mechanism = loaded(mechanism, settings)
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


def observed_legs(legs: list[Leg], tolerance_m: float | None = None) -> list[ObservedLeg]:
    """Legs in their initial positions; they share one set of tables.

    Raises
    ------
    AssemblyError
        If the linkage of a leg does not close or has a dead point.
    """
    setups: list[Setup] = []
    for setup in prepare_legs(legs):
        if not isinstance(setup, Setup):
            raise setup
        setups.append(setup)
    tables = build_tables(setups[0].linkage, setups[0].contacts)
    return [ObservedLeg(leg, setup, tables, tolerance_m) for leg, setup in zip(legs, setups, strict=True)]


def check_points(mechanism: Mechanism, settings: list[dict[str, Any]]) -> None:
    """Prepare one leg of every setting, equal ones once, so that errors are reported before any computation.

    Raises
    ------
    ConfigError
        If a setting is invalid or names no joint.
    AssemblyError
        If a linkage does not close or has a dead point.
    """
    legs = [ensemble(mechanism, each | {"runs": 1})[0] for each in settings]
    for leg in {repr(leg): leg for leg in legs}.values():
        if not leg.clearances:
            raise ConfigError("joints", "", "names no joint")
        leg.prepare()

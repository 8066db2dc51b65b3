"""Wear that feeds back over a life: lives by cycle jumps, each read off where a joint has opened so far."""

from typing import Any

import numpy as np

from leg_wear_monitor.errors import SimulationError
from leg_wear_monitor.life.life import LifeRun, LifeSettings, simulate_life
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.wear.cycle_jump import JumpControl

STATES = 41  # of a life, from new to its end, by equal openings; an odd number


def wear_life(mechanism: Mechanism, settings: dict[str, Any]) -> Arrays:
    """Lives of an ensemble.

    Returns
    -------
    dict of arrays
        Runs r, states of wear w (the first without any), clearance joints k, sectors N: ``cycles`` (r, w)
        since new; ``clearance_mean_m`` and ``clearance_max_m`` (r, w, k); ``depth_m`` (r, 2, k, 2, N) halfway
        and at the end; ``rate_m_per_cycle`` (r, 2, k, 2, N) when new and at the end; ``peak_force_n``
        (r, w, k) and ``toe_position_m`` (r, w) the largest of a cycle.

    Raises
    ------
    SimulationError
        Where the motion diverges, or nothing wears.
    """
    lives = [_life(mechanism, settings, run) for run in range(settings["runs"])]
    result = {name: np.array([life[name] for life in lives]) for name in lives[0]}
    return result | {"clearance_joints": np.array(settings["clearance_joints"])}


def _life(mechanism: Mechanism, settings: dict[str, Any], member: int) -> dict[str, Floats]:
    run = LifeRun(
        mechanism,
        LifeSettings(
            legs=1,
            cycles=settings["cycles"],
            perturb_fraction=settings["perturb_fraction"],
            jump=JumpControl.of(settings["jump_m"]),
            seed=settings["seed"] + member,
        ),
        clearances=settings["clearance_joints"],
        clearance_m=settings["clearance_m"],
        speed_rpm=settings["speed_rpm"],
    )
    life = simulate_life(run, limit_m=run.fresh_m + settings["opens_m"], horizon_cycles=np.inf)
    opened = (life.clearance_m - run.fresh_m).max(axis=1)
    if opened[-1] < settings["opens_m"]:
        raise SimulationError(
            f"none of {', '.join(run.clearance_joints)} wears, look at their wear_coefficient"
        )
    cycles = np.interp(np.linspace(0.0, settings["opens_m"], STATES), opened, life.cycles)
    depth = between(life.cycles, life.depth, cycles)
    rate = between(life.cycles, np.array([point.rate.depth for point in run.points]), cycles[[0, -1]])
    toe = np.array([point.toe_position_m for point in run.points])
    profile = depth.sum(axis=2)  # of both surfaces, each in its own frame
    return {
        "cycles": cycles,
        "clearance_mean_m": run.fresh_m + profile.mean(axis=2),
        "clearance_max_m": run.fresh_m + profile.max(axis=2),
        "depth_m": depth[[STATES // 2, -1]].astype(np.float32),
        "rate_m_per_cycle": rate.astype(np.float32),
        "peak_force_n": between(life.cycles, life.peak_force_n, cycles),
        "toe_position_m": between(life.cycles, toe, cycles),
    }


def between(cycles: Floats, values: Floats, at: Floats) -> Floats:
    """Values (p, ...) at other cycles (w,) than those (p,) that they are known at, on straight lines."""
    left = np.clip(np.searchsorted(cycles, at) - 1, 0, len(cycles) - 2)
    fraction = (at - cycles[left]) / np.diff(cycles)[left]
    fraction = fraction.reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(values[left] + fraction * (values[left + 1] - values[left]))

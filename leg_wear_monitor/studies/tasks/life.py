"""Wear lives with wear feedback, by cycle jumps, sampled at equal increases of the largest clearance."""

from typing import Any

import numpy as np

from leg_wear_monitor.errors import SimulationError
from leg_wear_monitor.life.life import LifeRun, LifeSettings, simulate_life
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.tasks.ensemble import loaded
from leg_wear_monitor.wear.cycle_jump import JumpControl

STATES = 41  # states of a life at equal increases of clearance, new and end included; odd: one is halfway


def wear_life(mechanism: Mechanism, settings: dict[str, Any]) -> Arrays:
    """Wear lives of an ensemble.

    Returns
    -------
    dict of arrays
        For runs r, states of wear w (the first is new), clearance joints k and sectors N:
        ``cycles`` (r, w): gait cycles since new;
        ``clearance_mean_m``, ``clearance_max_m`` (r, w, k): radial clearance;
        ``depth_m`` (r, 2, k, 2, N): wear depth of bushing and journal, halfway and at the end;
        ``rate_m_per_cycle`` (r, 2, k, 2, N): wear depth per cycle, when new and at the end;
        ``peak_force_n`` (r, w, k), ``toe_position_m`` (r, w): largest contact force and toe error of a cycle.

    Raises
    ------
    SimulationError
        If the motion diverges, or no joint wears.
    """
    mechanism = loaded(mechanism, settings)
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
    """Values (p, ...) at cycles (p,), interpolated linearly at the cycles ``at`` (w,); shape (w, ...)."""
    left = np.clip(np.searchsorted(cycles, at) - 1, 0, len(cycles) - 2)
    fraction = (at - cycles[left]) / np.diff(cycles)[left]
    fraction = fraction.reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(values[left] + fraction * (values[left + 1] - values[left]))

"""Wear that feeds back over a life: some cycles are simulated, their mean wear is repeated, and so on.

An extrapolation as that of Mukras and others (Wear 268, 2010): a jump ends where the joint that wears fastest
has opened by a given step.
"""

from typing import Any

import numpy as np

from leg_wear_monitor.dynamics.batch_leg import Leg
from leg_wear_monitor.dynamics.tally import new_tally
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.ensemble import ensemble, watch
from leg_wear_monitor.studies.grid import SAMPLES
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.watch import WatchedLeg
from leg_wear_monitor.wear.cycle_jump import JumpControl, smoothed

SETTLE_CYCLES = 1  # before those whose wear is repeated: the surfaces have just changed

_SMOOTH_DEG = JumpControl().smooth_deg  # a few cycles touch here and there, repeated they would cut notches


def live(mechanism: Mechanism, settings: dict[str, Any]) -> Arrays:
    """Lives of an ensemble.

    Returns
    -------
    dict of arrays
        Over runs r, states of wear w (the first without any), loose joints k and sectors N: ``cycles`` (r, w)
        since new; ``clearance_mean_m`` and ``clearance_max_m`` (r, w, k); ``depth_m`` (r, 2, k, 2, N) halfway
        and at the end; ``rate_m_per_cycle`` (r, 2, k, 2, N) when new and at the end; ``peak_force_n``,
        ``toe_position_m`` (r, w - 1, ...) the largest of the cycles simulated before each jump.
    """
    legs: list[Leg] = ensemble(mechanism, settings, wear=True)
    lives = [_life(leg, settings) for leg in watch(legs)]
    result = {name: np.array([life[name] for life in lives]) for name in lives[0]}
    return result | {"loose": np.array(settings["loose"])}


def _life(leg: WatchedLeg, settings: dict[str, Any]) -> dict[str, Floats]:
    surfaces, clearance = leg.setup.surfaces, leg.setup.contacts.clearance
    step, jumps = settings["opens_m"] / settings["jumps"], settings["jumps"]
    cycles, opened = [0.0], [surfaces.depth.copy()]
    rates: list[Floats] = []
    peaks: list[Floats] = []
    errors: list[float] = []
    for _ in range(jumps):
        rate, peak, error = _wear_a_cycle(leg, settings["cycles"])
        fastest = rate.mean(axis=2).sum(axis=1).max()
        surfaces.depth[:] = opened[-1] + rate * (step / fastest)
        cycles.append(cycles[-1] + step / fastest)
        opened.append(surfaces.depth.copy())
        rates.append(rate)
        peaks.append(peak)
        errors.append(error)
    depths = [opened[jumps // 2], opened[-1]]
    profile = np.array(opened).sum(axis=2)  # of both surfaces, each in its own frame
    return {
        "cycles": np.array(cycles),
        "clearance_mean_m": clearance + profile.mean(axis=2),
        "clearance_max_m": clearance + profile.max(axis=2),
        "depth_m": np.array(depths, dtype=np.float32),
        "rate_m_per_cycle": np.array([rates[0], rates[-1]], dtype=np.float32),
        "peak_force_n": np.array(peaks),
        "toe_position_m": np.array(errors),
    }


def _wear_a_cycle(leg: WatchedLeg, cycles: int) -> tuple[Floats, Floats, float]:
    """Mean wear of a cycle (k, 2, N) [m]; largest forces (j,) [N] and toe error [m] meanwhile."""
    joints = len(leg.setup.linkage.mechanism.joints)
    leg.advance(SETTLE_CYCLES * SAMPLES, new_tally(joints))
    tally, before = new_tally(joints), leg.setup.surfaces.depth.copy()
    leg.advance(cycles * SAMPLES, tally)
    worn = leg.setup.surfaces.depth - before
    return smoothed(worn / cycles, _SMOOTH_DEG), tally.peak.copy(), float(tally.response[0])

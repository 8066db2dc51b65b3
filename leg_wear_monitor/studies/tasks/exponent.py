"""The largest Lyapunov exponent of a leg.

The eccentricities are continuous, but their rates change within the short duration of an impact: if the
neighbour's impact begins a moment later, its rate differs strongly during that moment. Therefore the
neighbour is rescaled only while both legs have the same joints in contact. The state consists of
eccentricities, their rates and the approach speed of each contact; the crank's motion is prescribed and equal
for both.
"""

from typing import Any

import numpy as np

from leg_wear_monitor.dynamics.clearance.stepper import Snapshot
from leg_wear_monitor.dynamics.run.run_statistics import new_run_statistics
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.tasks.ensemble import ensemble, observed_legs
from leg_wear_monitor.studies.tasks.grid import SAMPLES
from leg_wear_monitor.studies.tasks.lyapunov import stretches
from leg_wear_monitor.studies.tasks.observed_leg import ObservedLeg


def lyapunov_exponent(mechanism: Mechanism, settings: dict[str, Any]) -> Arrays:
    """Growth of the distance between neighbouring motions.

    Returns
    -------
    dict of arrays
        ``stretch_per_cycle`` (r, c) [-]: logarithm of the growth factor in each cycle c of each run r;
        ``period_s`` (): duration of a cycle [s]; ``clearance_joints`` (k,): names.

    Raises
    ------
    SimulationError
        If the motion diverges.
    """
    legs = observed_legs(ensemble(mechanism, settings), settings["tolerance_m"])
    logs = np.array([_follow(leg, settings) for leg in legs])
    runs, cycles = settings["runs"], settings["cycles"]
    return {
        "clearance_joints": np.array(legs[0].setup.clearance_joints),
        "stretch_per_cycle": logs.reshape(runs, cycles, settings["renewals"]).sum(axis=2),
        "period_s": np.array(TURN / abs(legs[0].setup.speed)),
    }


def _follow(leg: ObservedLeg, settings: dict[str, Any]) -> Floats:
    """Logarithmic growth factors (steps,) of one run."""
    stepper, statistics = leg.stepper, new_run_statistics(len(leg.setup.linkage.mechanism.joints))
    leg.advance(settings["skip_cycles"] * SAMPLES, statistics)
    steps, depth = SAMPLES // settings["renewals"], stepper.snapshot().depth

    def advance(motion: Floats) -> Floats:
        stepper.restore(Snapshot(motion, depth))
        leg.advance(steps, statistics)
        return stepper.snapshot().motion

    scale, approach = _scale(leg), stepper.snapshot_mask("approach")

    def same_contacts(one: Floats, other: Floats) -> bool:
        return bool(np.array_equal(one[approach] > 0.0, other[approach] > 0.0))

    direction = np.random.default_rng([settings["seed"], 2]).normal(size=len(scale))
    direction[approach] = 0.0
    return stretches(
        advance, stepper.snapshot().motion, direction, scale,
        settings["distance"], settings["cycles"] * settings["renewals"], same_contacts,
    )  # fmt: skip


def _scale(leg: ObservedLeg) -> Floats:
    """Scale of each number of the state: the clearance, and clearance times crank speed for rates."""
    clearance = float(leg.setup.contacts.clearance.min())
    rate = clearance * abs(leg.setup.speed)
    units = {"e": clearance, "v": rate, "approach": rate}
    scale = np.zeros(len(leg.stepper.snapshot().motion))
    for name, unit in units.items():
        scale[leg.stepper.snapshot_mask(name)] = unit
    return scale

"""The largest Lyapunov exponent of a leg.

The motion is smooth between impacts and jumps nowhere in the journals' places, but their rates change within
the time of an impact: a neighbour that touches a moment later is for that moment far off in its rate. So a
neighbour is brought back only while both legs have the same joints in contact. Its state are places,
rates, and the approach speed that a contact remembers; the crank's motion is given and the same for both.
"""

from typing import Any

import numpy as np

from leg_wear_monitor.dynamics.clearance.stepper import Snapshot
from leg_wear_monitor.dynamics.run.run_statistics import new_run_statistics
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.tasks.contact_watch import ObservedLeg
from leg_wear_monitor.studies.tasks.ensemble import ensemble, watch
from leg_wear_monitor.studies.tasks.grid import SAMPLES
from leg_wear_monitor.studies.tasks.lyapunov import stretches


def lyapunov_exponent(mechanism: Mechanism, settings: dict[str, Any]) -> Arrays:
    """Growth of small distances between neighbouring motions.

    Returns
    -------
    dict of arrays
        ``stretch_per_cycle`` (r, c): the logarithm of the growth of a distance in each cycle of each run;
        ``period_s`` () of a cycle.
    """
    legs = watch(ensemble(mechanism, settings), settings["tolerance_m"])
    logs = np.array([_follow(leg, settings) for leg in legs])
    runs, cycles = settings["runs"], settings["cycles"]
    return {
        "clearance_joints": np.array(legs[0].setup.clearance_joints),
        "stretch_per_cycle": logs.reshape(runs, cycles, settings["renewals"]).sum(axis=2),
        "period_s": np.array(TURN / abs(legs[0].setup.speed)),
    }


def _follow(leg: ObservedLeg, settings: dict[str, Any]) -> Floats:
    """Stretches of one run."""
    stepper, statistics = leg.stepper, new_run_statistics(len(leg.setup.linkage.mechanism.joints))
    leg.advance(settings["skip_cycles"] * SAMPLES, statistics)
    steps, depth = SAMPLES // settings["renewals"], stepper.snapshot().depth

    def advance(motion: Floats) -> Floats:
        stepper.restore(Snapshot(motion, depth))
        leg.advance(steps, statistics)
        return stepper.snapshot().motion

    scale, approach = _scale(leg), stepper.place_in_snapshot("approach")

    def same_contacts(one: Floats, other: Floats) -> bool:
        return bool(np.array_equal(one[approach] > 0.0, other[approach] > 0.0))

    direction = np.random.default_rng([settings["seed"], 2]).normal(size=len(scale))
    direction[approach] = 0.0
    return stretches(
        advance, stepper.snapshot().motion, direction, scale,
        settings["distance"], settings["cycles"] * settings["renewals"], same_contacts,
    )  # fmt: skip


def _scale(leg: ObservedLeg) -> Floats:
    """Unit of each number of the state: the clearance, and the clearance a radian of the crank for rates."""
    clearance = float(leg.setup.contacts.clearance.min())
    rate = clearance * abs(leg.setup.speed)
    units = {"e": clearance, "v": rate, "approach": rate}
    scale = np.zeros(len(leg.stepper.snapshot().motion))
    for name, unit in units.items():
        scale[leg.stepper.place_in_snapshot(name)] = unit
    return scale

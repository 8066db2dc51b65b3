"""The twin: in step with a gait it wears as the simulation does, however the samples come in."""

from collections.abc import Callable

import numpy as np

import leg_wear_monitor as lw
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.figures import Happening, Tracking
from leg_wear_monitor.twin.sample import Samples


def test_a_steady_gait_wears_as_a_steady_simulation(
    leg: lw.Mechanism, twin: DigitalTwin, gait: Callable[..., Samples]
) -> None:
    """Encoder noise and all; the first joint carries the drive and varies least."""
    update = twin.update(gait(12.0))
    archard = np.array([cycle.archard_j for cycle in update.cycles])
    result = lw.simulate(leg, cycles=12, wear=True)
    wanted = [result.joints[name]["archard_integral_j_per_cycle"] for name in twin.loose]
    wrong = np.abs(archard.mean(axis=0) / wanted - 1.0)
    assert (wrong < [0.02, 0.06, 0.06, 0.08, 0.15]).all(), wrong
    assert twin.tracking is Tracking.IN_STEP
    assert [event.what for event in update.events] == [Happening.ACQUIRED]

"""Counted clearances that are surely wrong, and what becomes of the evidence when they are corrected."""

from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.diagnosis.diagnosis import Change
from leg_wear_monitor.monitor.diagnosis.evidence import SETTLING_CYCLES
from leg_wear_monitor.monitor.diagnosis.state import TorqueState
from leg_wear_monitor.monitor.ledger.entry import CommissionedTorque

# of the counted clearance: smaller openings are named wrongly where masses are 5 % off (diagnosis.md)
CORRECTED_FROM = 1.3


class Correction(NamedTuple):
    """A counted clearance that is surely wrong: joint index, its clearance [m], and the change behind it."""

    joint: int
    clearance_m: float
    change: Change


def correction_of(state: TorqueState, joints: Sequence[str]) -> Correction | None:
    """A settled change of one clearance."""
    if not state.changes or state.fit_cycles < SETTLING_CYCLES:
        return None
    change = state.changes[-1]
    is_wide = change.value >= CORRECTED_FROM * change.counted
    if change.subject not in joints or not change.is_sure or not is_wide:
        return None
    return Correction(joints.index(change.subject), change.value, change)


def settle(state: TorqueState, change: Change, counted_m: Floats) -> None:
    """Make the gait cycles since a change those of the commissioned leg, with clearances (k,) [m].

    What the correction is off does then not look like a further change.
    """
    cycles = [cycle for cycle in state.cycles if cycle.begin_ns >= change.since_ns]
    signatures = np.array([cycle.signature for cycle in cycles])
    state.commissioned = CommissionedTorque(cycles[-1].end_ns, counted_m, signatures)
    state.settled = (*state.settled, attrs.evolve(change, is_corrected=True))
